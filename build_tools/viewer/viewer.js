/* The program of viewer.html: the scene with its lightmaps, and a panel. Bundled by `build.py viewer`. */

import {
  ACESFilmicToneMapping, AgXToneMapping, Box3, Color, CubeCamera, DataTexture, EquirectangularReflectionMapping,
  FloatType, HalfFloatType, LinearFilter, LinearSRGBColorSpace, LinearToneMapping, NeutralToneMapping,
  PerspectiveCamera, PMREMGenerator, Raycaster, RGBAFormat, Scene, Vector2, Vector3, WebGLCubeRenderTarget, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { colorsOf, loadLit, readKtx2 } from '../../radiosity_addon/exports/assets/three-lightmap.js';

const LUMINANCE = [0.2126, 0.7152, 0.0722];
/* Blender's view transforms by the begin of their names; all others are as Standard. Filmic is nearest to AgX. */
const VIEWS = { AgX: AgXToneMapping, Filmic: AgXToneMapping, 'Khronos PBR Neutral': NeutralToneMapping, ACES: ACESFilmicToneMapping };
const CHOICES = { AgX: AgXToneMapping, Standard: LinearToneMapping, Neutral: NeutralToneMapping, ACES: ACESFilmicToneMapping };
const byId = (id) => document.getElementById(id);

function embedded(name) {
  const text = document.querySelector(`script[data-file="${CSS.escape(name)}"]`)?.textContent;
  return text && Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

async function start() {
  const read = async (name) => embedded(name);
  const [shiny, matte] = [await loadLit('scene.glb', { read }), await loadLit('scene.glb', { read, matte: true })];
  const renderer = new WebGLRenderer({ antialias: true });
  sharpen(renderer, [...shiny.materials.values(), ...matte.materials.values()]);
  document.body.append(renderer.domElement);
  const scene = new Scene();
  scene.background = await background() ?? new Color(0x202224);
  const camera = cameraOf(shiny);
  const target = targetOf(shiny, camera); // before the controls turn the camera
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.target.copy(target);
  controls.update();

  let lit = shiny;
  scene.add(lit.scene);
  const { view } = shiny.index;
  const own = Object.entries(VIEWS).find(([name]) => view.transform.startsWith(name))?.[1] ?? LinearToneMapping;
  for (const [name, mapping] of Object.entries(CHOICES)) byId('view').add(new Option(name, mapping, mapping === own, mapping === own));
  byId('exposure').value = view.exposure;
  const draw = () => {
    renderer.toneMapping = Number(byId('view').value);
    renderer.toneMappingExposure = 2 ** byId('exposure').valueAsNumber;
    byId('stops').value = byId('exposure').valueAsNumber.toFixed(1);
    renderer.render(scene, camera);
  };
  const resize = () => {
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(innerWidth, innerHeight);
    camera.aspect = innerWidth / innerHeight;
    camera.fov = fovFor(shiny, camera.aspect);
    camera.updateProjectionMatrix();
    draw();
  };
  const showOnly = () => {
    for (const each of [shiny, matte]) for (const material of each.materials.values()) lightmapOnly(material, byId('only').checked);
    draw();
  };
  byId('exposure').addEventListener('input', draw);
  byId('view').addEventListener('change', draw);
  byId('auto').addEventListener('click', () => {
    byId('exposure').value = Math.log2(exposureFor(shiny));
    draw();
  });
  byId('only').addEventListener('change', showOnly);
  byId('matte').addEventListener('change', () => {
    scene.remove(lit.scene);
    lit = byId('matte').checked ? matte : shiny;
    scene.add(lit.scene);
    draw();
  });
  controls.addEventListener('change', draw);
  addEventListener('resize', resize);
  const reflect = () => reflectIn(renderer, scene, shiny, camera, target);
  addSliders([shiny, matte], () => { reflect(); draw(); });
  reflect();
  const raycaster = new Raycaster();
  renderer.domElement.addEventListener('pointermove', (event) => {
    const place = new Vector2(2 * event.clientX / innerWidth - 1, 1 - 2 * event.clientY / innerHeight);
    raycaster.setFromCamera(place, camera);
    byId('lux').textContent = illuminanceAt(lit, raycaster.intersectObject(lit.scene, true)[0]);
  });
  byId('message').remove();
  byId('panel').hidden = false;
  resize();
  Object.assign(window, { viewer: { renderer, scene, camera, controls, shiny, matte, draw, raycaster } });
}

/** Textures seen at a slant stay sharp along what they are not shrunk across; lightmaps have no mip levels. */
function sharpen(renderer, materials) {
  const most = renderer.capabilities.getMaxAnisotropy();
  for (const material of materials) {
    for (const name of ['map', 'emissiveMap', 'normalMap', 'roughnessMap', 'metalnessMap']) {
      if (material[name]) material[name].anisotropy = most;
    }
  }
}

/** What is behind all objects, around: rows of the file from the top, of textures from the bottom. */
async function background() {
  const file = embedded('background.ktx2');
  if (!file) return null;
  const seen = await readKtx2(file), colors = colorsOf(seen), row = 4 * seen.width;
  const flipped = new Float32Array(colors.length);
  for (let y = 0; y < seen.height; y++) flipped.set(colors.subarray(y * row, (y + 1) * row), (seen.height - 1 - y) * row);
  const texture = new DataTexture(flipped, seen.width, seen.height, RGBAFormat, FloatType);
  texture.mapping = EquirectangularReflectionMapping;
  texture.colorSpace = LinearSRGBColorSpace; // so that it is tone-mapped
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

function cameraOf(lit) {
  const camera = new PerspectiveCamera(50, 1, 0.01, 1000);
  const own = lit.gltf.cameras.find((each) => each.isPerspectiveCamera);
  const box = new Box3().setFromObject(lit.scene), size = box.getSize(new Vector3()).length() || 1;
  camera.near = size / 2000;
  camera.far = 10 * size;
  if (own) {
    own.updateWorldMatrix(true, false);
    own.matrixWorld.decompose(camera.position, camera.quaternion, camera.scale);
    camera.scale.set(1, 1, 1);
  } else {
    camera.position.copy(box.getCenter(new Vector3())).add(new Vector3(0.6, 0.4, 0.8).multiplyScalar(size));
  }
  return camera;
}

/** The vertical field of view that shows all that the scene's camera does. */
function fovFor(lit, aspect) {
  const own = lit.gltf.cameras.find((each) => each.isPerspectiveCamera);
  if (!own || aspect >= own.aspect) return own?.fov ?? 50;
  const tangent = Math.tan(own.fov * Math.PI / 360) * own.aspect / aspect;
  return Math.min(Math.atan(tangent) * 360 / Math.PI, 100);
}

/** What to orbit: what the camera looks at, at the distance of the first surface. */
function targetOf(lit, camera) {
  const box = new Box3().setFromObject(lit.scene), center = box.getCenter(new Vector3());
  if (!lit.gltf.cameras.length) return center;
  const ahead = camera.getWorldDirection(new Vector3());
  const distance = Math.max(center.clone().sub(camera.position).dot(ahead), 0.1 * box.getSize(center).length());
  return camera.position.clone().addScaledVector(ahead, distance);
}

/** The exposure that makes the mean of lit texels a middle gray. */
function exposureFor(lit) {
  let sum = 0, count = 0;
  for (let number = 0; number < lit.pages.length; number++) {
    const page = lit.pages[number];
    for (let k = 0; k < 4096; k++) {
      const texel = lit.irradiance(number, (k % 64 + 0.5) / 64, (Math.floor(k / 64) + 0.5) / 64);
      const light = luminance(texel) / Math.PI;
      if (light > 0 && page) { sum += Math.log(light); count += 1; }
    }
  }
  return count ? 0.3 / Math.exp(sum / count) : 1;
}

function luminance(color) {
  return color.reduce((sum, value, c) => sum + LUMINANCE[c] * value, 0);
}

function illuminanceAt(lit, hit) {
  const lightmap = hit && [hit.object.material].flat()[0].userData.lightmap;
  if (!lightmap || !hit.uv1) return '';
  const light = lit.irradiance(lightmap.page, ...lit.onPage(hit.object, hit.uv1.x, hit.uv1.y));
  const lux = lit.index.lumens_per_watt * luminance(light);
  const plain = lux >= 100 ? lux.toFixed(0) : lux.toPrecision(3);
  return `${plain} lx · ${luminance(light).toPrecision(3)} W/m² · ${hit.object.name}`;
}

function lightmapOnly(material, only) {
  material.userData.kept ??= { color: material.color.clone(), map: material.map, metalness: material.metalness,
    emissiveIntensity: material.emissiveIntensity, aoMap: material.aoMap, mirrors: material.envMap };
  const kept = material.userData.kept;
  material.color.copy(only ? new Color(1, 1, 1) : kept.color);
  material.emissiveIntensity = only ? 0 : kept.emissiveIntensity;
  // Cut-outs are in the image of the color.
  material.map = only && !material.alphaTest && !material.transparent ? null : kept.map;
  if (kept.metalness !== undefined) material.metalness = only ? 0 : kept.metalness;
  if (kept.mirrors) material.envMap = only ? null : kept.mirrors;
  material.needsUpdate = true;
}

/** Metal mirrors what is around the place that is looked at: a lightmap holds no surroundings. It has no diffuse
 *  color, to which three.js would add their light once more. */
function reflectIn(renderer, scene, lit, camera, place) {
  const metals = [...lit.materials.values()].filter((each) => each.metalness > 0.99 && !each.metalnessMap);
  if (!metals.length) return;
  const seen = new WebGLCubeRenderTarget(256, { type: HalfFloatType });
  const around = new CubeCamera(camera.near, camera.far, seen);
  around.position.copy(place);
  for (const material of metals) material.visible = false; // the place may be within one
  around.update(renderer, scene);
  const filtered = new PMREMGenerator(renderer).fromCubemap(seen.texture).texture;
  for (const material of metals) {
    material.envMap?.dispose();
    Object.assign(material, { envMap: filtered, visible: true });
    if (material.userData.kept) material.userData.kept.mirrors = filtered;
    material.needsUpdate = true;
  }
  seen.dispose();
}

function addSliders(scenes, draw) {
  const [first] = scenes;
  if (!first.groups.length) return;
  const groups = byId('groups');
  groups.innerHTML = '<h2>Light groups</h2>';
  for (const group of first.groups) {
    const row = document.createElement('label'), slider = document.createElement('input');
    row.append(group.name, slider);
    Object.assign(slider, { type: 'range', min: 0, max: 3, step: 0.05, value: 1 });
    const baked = [...group.factor];
    slider.addEventListener('change', () => {
      for (const each of scenes) each.mix({ [group.name]: baked.map((value) => value * slider.valueAsNumber) });
      draw();
    });
    groups.append(row);
  }
}

start().catch((error) => { byId('message').textContent = `The scene cannot be shown: ${error.message}`; throw error; });
