/* Draws an export in three.js, in linear floats, and posts the pixels back. See browser.py. */

import {
  FloatType, LinearFilter, NoToneMapping, Scene, WebGLRenderer, WebGLRenderTarget,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { loadLit } from '../../radiosity_addon/exports/assets/three-lightmap.js';

const asked = new URLSearchParams(location.search);
const [width, height] = [Number(asked.get('width')), Number(asked.get('height'))];

async function exact(lit) {
  for (let page = 0; page < lit.pages.length; page++) {
    const texture = await new EXRLoader().setDataType(FloatType).loadAsync(`/export/${lit.index.pages[page].exr}`);
    Object.assign(texture, { flipY: true, needsUpdate: true, channel: 1, minFilter: LinearFilter, magFilter: LinearFilter });
    for (const material of lit.materials.values()) {
      if (material.userData.lightmap.page !== page) continue;
      const { repeat, offset } = material.lightMap;
      material.lightMap = texture.clone();
      material.lightMap.repeat.copy(repeat);
      material.lightMap.offset.copy(offset);
    }
  }
}

async function load(form) {
  if (form === 'baked') return new GLTFLoader().loadAsync('/export/scene_baked.glb');
  const encoding = form === 'rgbm' ? 'rgbm' : 'ktx2';
  const lit = await loadLit('/export/scene.glb', { matte: true, encoding });
  if (form === 'exr') await exact(lit);
  for (const material of lit.materials.values()) if (asked.get('only')) only(material);
  return lit.gltf;
}

function only(material) {
  material.color.set(1, 1, 1);
  material.emissive.set(0, 0, 0);
  if (!material.alphaTest) material.map = null;
}

async function start() {
  const gltf = await load(asked.get('form'));
  const scene = new Scene();
  scene.add(gltf.scene);
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse(({ material }) => {
    // Blender's renders filter images bilinearly.
    for (const each of [material].flat().filter(Boolean)) {
      for (const map of [each.map, each.emissiveMap]) {
        if (map) Object.assign(map, { minFilter: LinearFilter, generateMipmaps: false, needsUpdate: true });
      }
    }
  });
  const camera = gltf.cameras[0];
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
  const renderer = new WebGLRenderer();
  renderer.toneMapping = NoToneMapping;
  const target = new WebGLRenderTarget(width, height, { type: FloatType });
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  await fetch('/result', { method: 'POST', body: pixels });
}

start().catch((error) => fetch('/error', { method: 'POST', body: String(error.stack ?? error) }));
