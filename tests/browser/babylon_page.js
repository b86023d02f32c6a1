/* Draws an export in Babylon.js, in linear floats, and posts the pixels back. See browser.py. */

import { Engine } from '@babylonjs/core/Engines/engine.js';
import { Scene } from '@babylonjs/core/scene.js';
import { Texture } from '@babylonjs/core/Materials/Textures/texture.js';
import { RawTexture } from '@babylonjs/core/Materials/Textures/rawTexture.js';
import { RenderTargetTexture } from '@babylonjs/core/Materials/Textures/renderTargetTexture.js';
import { Constants } from '@babylonjs/core/Engines/constants.js';
import { Color3, Color4 } from '@babylonjs/core/Maths/math.color.js';
import { LoadAssetContainerAsync } from '@babylonjs/core/Loading/sceneLoader.js';
import '@babylonjs/loaders/glTF/2.0/index.js';
import { colorsOf, readKtx2 } from '../../radiosity_addon/exports/assets/three-lightmap.js';

const asked = new URLSearchParams(location.search);
const [width, height] = [Number(asked.get('width')), Number(asked.get('height'))];

/** A page as floats, from our KTX2: rows from the top, as glTF's coordinates have them. */
async function lightmap(scene, page) {
  const read = await readKtx2(await (await fetch(`/export/${page.ktx2}`)).arrayBuffer());
  const texture = RawTexture.CreateRGBATexture(
    colorsOf(read), read.width, read.height, scene, false, false, Texture.BILINEAR_SAMPLINGMODE,
    Constants.TEXTURETYPE_FLOAT);
  Object.assign(texture, { coordinatesIndex: 1, gammaSpace: false, level: 1 });
  texture.wrapU = texture.wrapV = Texture.CLAMP_ADDRESSMODE;
  return texture;
}

async function start() {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [width, height];
  const engine = new Engine(canvas, false, { useHighPrecisionFloats: true });
  const scene = new Scene(engine);
  const baked = asked.get('form') === 'baked';
  const container = await LoadAssetContainerAsync(
    baked ? '/export/scene_baked.glb' : '/export/scene.glb', scene);
  container.addAllToScene();
  scene.environmentTexture = null;
  scene.imageProcessingConfiguration.applyByPostProcess = true; // materials write linear values
  const index = await (await fetch('/export/lightmaps.json')).json();
  const pages = await Promise.all(index.pages.map((page) => lightmap(scene, page)));
  for (const material of container.materials) {
    for (const map of [material.albedoTexture, material.emissiveTexture]) {
      if (!map) continue;
      map.updateSamplingMode(Texture.BILINEAR_SAMPLINGMODE);
      map.anisotropicFilteringLevel = 1;
    }
    if (baked) continue;
    const told = material.metadata?.gltf?.extras?.lightmap;
    if (!told) continue;
    // Emission is added to what is unlit by Babylon only as a color.
    material.unlit = true;
    material.lightmapTexture = pages[told.page];
    material.useLightmapAsShadowmap = true;
    if (asked.get('only')) {
      material.albedoColor = new Color3(1, 1, 1);
      material.emissiveColor = new Color3(0, 0, 0);
      if (!material.needAlphaTesting()) material.albedoTexture = null;
    }
  }
  scene.clearColor = new Color4(0, 0, 0, 0);
  scene.activeCamera = container.cameras[0];
  const target = new RenderTargetTexture(
    'result', { width, height }, scene, { generateMipMaps: false, type: Constants.TEXTURETYPE_FLOAT });
  target.activeCamera = container.cameras[0];
  target.renderList = null;
  target.clearColor = scene.clearColor;
  scene.customRenderTargets.push(target);
  await scene.whenReadyAsync();
  for (let frame = 0; frame < 3; frame++) scene.render();
  const pixels = await target.readPixels();
  await fetch('/result', { method: 'POST', body: pixels });
}

start().catch((error) => fetch('/error', { method: 'POST', body: String(error.stack ?? error) }));
