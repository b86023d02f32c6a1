// Not run in its engine yet: written after Unity 2022's documentation. Report what fails, please.
//
// Puts the lightmaps of lightmaps.json on an imported scene.glb (glTFast). Copy the export's folder into Assets, set
// the .exr files to Texture Type: Lightmap, add this component to the root of scene.glb in a scene, and drag
// lightmaps.json and the .exr files, in the order of its pages, into its fields. Unity keeps no lightmap index of
// renderers that it did not bake, so the component sets it whenever the scene is loaded.

using System;
using System.Collections.Generic;
using UnityEngine;

[ExecuteAlways]
public class RadiosityLightmaps : MonoBehaviour
{
    public TextAsset index;
    public Texture2D[] pages = Array.Empty<Texture2D>();

    [Serializable] class NodeEntry { public string node; public int page; public float[] scale; public float[] offset; }
    [Serializable] class Index { public NodeEntry[] nodes; }

    void OnEnable() => Apply();

    public void Apply()
    {
        if (index == null) return;
        var first = LightmapSettings.lightmaps.Length;
        var all = new List<LightmapData>(LightmapSettings.lightmaps);
        foreach (var page in pages) all.Add(new LightmapData { lightmapColor = page });
        LightmapSettings.lightmapsMode = LightmapsMode.NonDirectional;
        LightmapSettings.lightmaps = all.ToArray();
        var entries = new Dictionary<string, NodeEntry>();
        foreach (var entry in JsonUtility.FromJson<Index>(index.text).nodes) entries[entry.node] = entry;
        foreach (var renderer in GetComponentsInChildren<Renderer>(true))
        {
            // A mesh of several materials is imported as several renderers below the node.
            var found = entries.TryGetValue(renderer.name, out var entry)
                || (renderer.transform.parent != null && entries.TryGetValue(renderer.transform.parent.name, out entry));
            if (!found) continue;
            renderer.lightmapIndex = first + entry.page;
            renderer.lightmapScaleOffset =
                new Vector4(entry.scale[0], entry.scale[1], entry.offset[0], entry.offset[1]);
        }
    }
}
