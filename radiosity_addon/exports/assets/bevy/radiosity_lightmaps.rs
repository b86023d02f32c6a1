// Not run in its engine yet: written after Bevy 0.16's source. Report what fails, please.
//
// A plugin that puts the lightmaps of lightmaps.json on a spawned scene.glb. Needs Bevy's features `ktx2` and `zstd`,
// and the crates serde (with `derive`) and serde_json. Copy the export's folder into assets, then:
//
//     app.add_plugins(RadiosityLightmaps { folder: "export".into() });
//
// Texels hold H/π; `exposure` of the plugin multiplies them, as Bevy's cameras expect luminance in nits.

use bevy::{pbr::Lightmap, prelude::*};
use serde::Deserialize;
use std::{collections::HashMap, path::PathBuf};

#[derive(Deserialize)]
struct Page { ktx2: String }

#[derive(Deserialize, Clone)]
struct NodeEntry { node: String, page: usize, scale: [f32; 2], offset: [f32; 2] }

#[derive(Deserialize)]
struct Index { pages: Vec<Page>, nodes: Vec<NodeEntry> }

#[derive(Resource)]
struct Known { pages: Vec<Handle<Image>>, nodes: HashMap<String, NodeEntry> }

pub struct RadiosityLightmaps { pub folder: PathBuf }

#[derive(Resource)]
struct Folder(PathBuf);

impl Plugin for RadiosityLightmaps {
    fn build(&self, app: &mut App) {
        app.insert_resource(Folder(self.folder.clone()))
            .add_systems(Startup, read_index)
            .add_systems(Update, apply.run_if(resource_exists::<Known>));
    }
}

fn read_index(folder: Res<Folder>, assets: Res<AssetServer>, mut commands: Commands) {
    let text = std::fs::read_to_string(PathBuf::from("assets").join(&folder.0).join("lightmaps.json"))
        .expect("lightmaps.json");
    let index: Index = serde_json::from_str(&text).expect("lightmaps.json of version 1");
    let pages = index.pages.iter().map(|page| assets.load(folder.0.join(&page.ktx2))).collect();
    let nodes = index.nodes.into_iter().map(|entry| (entry.node.clone(), entry)).collect();
    commands.insert_resource(Known { pages, nodes });
}

fn apply(
    known: Res<Known>,
    meshes: Query<(Entity, &ChildOf), (Added<Mesh3d>, Without<Lightmap>)>,
    names: Query<&Name>,
    mut commands: Commands,
) {
    for (entity, parent) in &meshes {
        // Primitives are children of their node, which has its name.
        let Ok(name) = names.get(parent.parent()) else { continue };
        let Some(entry) = known.nodes.get(name.as_str()) else { continue };
        let corner = Vec2::new(entry.offset[0], 1.0 - entry.offset[1] - entry.scale[1]);
        commands.entity(entity).insert(Lightmap {
            image: known.pages[entry.page].clone(),
            uv_rect: Rect::from_corners(corner, corner + Vec2::from(entry.scale)),
            bicubic_sampling: true,
        });
    }
}
