# Not run in its engine yet: written after Godot 4.4's source. Report what fails, please.
#
# Puts the lightmaps of lightmaps.json on an imported scene.glb, as Godot's own lightmapper would. Copy the export's
# folder into the project, open a scene with scene.glb in it, select the node of scene.glb, and run this script
# (File > Run in the script editor). It adds a LightmapGI node and saves its data as lightmaps.lmbake.
#
# Import scene.glb with Meshes > Light Baking: Static, so that TEXCOORD_1 stays UV2, and the .exr files without
# mipmaps, Compress: Lossless or VRAM Uncompressed.
@tool
extends EditorScript

const INDEX := "lightmaps.json"


func _run() -> void:
	var selected := get_editor_interface().get_selection().get_selected_nodes()
	if selected.size() != 1 or selected[0].scene_file_path == "":
		push_error("Select the node of scene.glb")
		return
	var root: Node = selected[0]
	var folder: String = root.scene_file_path.get_base_dir()
	var index: Dictionary = JSON.parse_string(FileAccess.get_file_as_string(folder.path_join(INDEX)))
	var images: Array[Image] = []
	for page in index["pages"]:
		var image: Image = load(folder.path_join(page["exr"])).get_image()
		image.convert(Image.FORMAT_RGBH)
		images.append(image)
	var layers := Texture2DArray.new()
	var failed := layers.create_from_images(images)
	if failed != OK:
		push_error("Pages must have one size: bake with --resolution and --pages")
		return
	var lightmaps := LightmapGI.new()
	lightmaps.name = "Radiosity Lightmaps"
	root.get_parent().add_child(lightmaps)
	lightmaps.owner = get_scene()
	var data := LightmapGIData.new()
	data.lightmap_textures = [layers]
	data.set_uses_spherical_harmonics(false)
	for entry in index["nodes"]:
		var node := root.find_child(entry["node"].validate_node_name(), true, false)
		if node == null:
			push_warning("no node '%s' in scene.glb" % entry["node"])
			continue
		var place := Rect2(
			entry["offset"][0], 1.0 - entry["offset"][1] - entry["scale"][1], entry["scale"][0], entry["scale"][1])
		data.add_user(lightmaps.get_path_to(node), place, int(entry["page"]), -1)
	lightmaps.light_data = data
	ResourceSaver.save(data, folder.path_join("lightmaps.lmbake"))
	print("Lightmaps of %d objects" % index["nodes"].size())
