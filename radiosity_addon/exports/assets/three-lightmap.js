/* Loads scene.glb with its lightmaps into three.js (r152 or later). MIT license, as three.js.

   import { loadLit } from './three-lightmap.js';
   const lit = await loadLit('scene.glb');   // lightmaps.json and the lightmaps lie next to it
   scene.add(lit.scene);

   matte: true shows base color × lightmap alone, without highlights, reflections or other lamps' shine.
   encoding: 'rgbm' reads the PNG images of an export with the form rgbm, where KTX2 cannot be had.
   lit.mix({ Kitchen: [1, 0.9, 0.8] }) mixes light groups by color times strength. */

import {
  DataTexture, FloatType, LinearFilter, MeshLambertMaterial, NoColorSpace, RGBAFormat, RGBFormat,
  UnsignedInt5999Type,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { ZSTDDecoder } from 'three/addons/libs/zstddec.module.js';

const E5B9G9R9 = 123;
let zstd = null;

/** Load a scene. `read(name)` returns a file as an ArrayBuffer; without it files are fetched next to `url`. */
export async function loadLit(url, {
  matte = false, encoding = 'ktx2', read = null, loader = new GLTFLoader(),
} = {}) {
  const folder = url.slice(0, url.lastIndexOf('/') + 1);
  read ??= async (name) => {
    const answer = await fetch(folder + name);
    if (!answer.ok) throw new Error(`${folder + name}: ${answer.status}`);
    return answer.arrayBuffer();
  };
  const gltf = await loader.parseAsync(await read(url.slice(folder.length)), folder);
  const index = JSON.parse(new TextDecoder().decode(await read('lightmaps.json')));
  const open = async (page) => {
    if (!page[encoding]) throw new Error(`lightmaps.json names no ${encoding} files: export with the form ${encoding}`);
    const file = await read(page[encoding]);
    return encoding === 'rgbm' ? readRgbm(file, page.rgbm_range) : readKtx2(file);
  };
  const pages = await Promise.all(index.pages.map(open));
  const groups = await Promise.all(index.light_groups.map(async (group) => (
    { ...group, pages: await Promise.all(group.pages.map(open)) })));
  return new LitScene(gltf, index, pages, groups, matte);
}

export class LitScene {
  constructor(gltf, index, pages, groups, matte) {
    Object.assign(this, { gltf, scene: gltf.scene, index, pages, groups });
    for (const group of groups) group.exported = [...group.factor];
    this.textures = pages.map(textureOf);
    this.materials = new Map();
    this.scene.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const list = [mesh.material].flat().map((material) => this.#lit(material, matte, placeOf(mesh)));
      mesh.material = Array.isArray(mesh.material) ? list : list[0];
    });
  }

  #lit(material, matte, place) {
    const lightmap = material.userData.lightmap;
    if (!lightmap) return material;
    const key = place ? `${material.uuid} ${place.scale} ${place.offset}` : material;
    if (!this.materials.has(key)) {
      this.materials.set(key, matte ? matteOf(material) : place ? material.clone() : material);
    }
    const made = this.materials.get(key);
    made.userData = { ...material.userData, place, glow: made.emissive?.clone() };
    made.lightMap = placed(this.textures[lightmap.page], place);
    made.lightMapIntensity = Math.PI; // texels hold H/π, and three.js divides by π
    made.needsUpdate = true;
    return made;
  }

  /** Mix light groups: factors by name, color times strength; those that are not named keep theirs. */
  mix(factors) {
    for (const group of this.groups) group.factor = factors[group.name] ?? group.factor;
    for (const made of this.materials.values()) {
      const { glow, lightmap } = made.userData;
      const group = this.groups.find((each) => each.name === lightmap.light_group);
      if (!group || !glow) continue;
      const ratio = group.factor.map((factor, c) => factor / (group.exported[c] || 1));
      made.emissive.setRGB(glow.r * ratio[0], glow.g * ratio[1], glow.b * ratio[2]);
    }
    this.pages.forEach((page, number) => {
      const sum = new Float32Array(4 * page.width * page.height).fill(1);
      for (let texel = 0; texel < sum.length; texel += 4) sum[texel] = sum[texel + 1] = sum[texel + 2] = 0;
      for (const group of this.groups) {
        const from = colorsOf(group.pages[number]);
        for (let texel = 0; texel < sum.length; texel += 4) {
          for (let c = 0; c < 3; c++) sum[texel + c] += group.factor[c] * from[texel + c];
        }
      }
      page.colors = sum;
      this.textures[number].dispose();
      const texture = this.textures[number] = prepared(
        new DataTexture(sum, page.width, page.height, RGBAFormat, FloatType));
      for (const made of this.materials.values()) {
        if (made.userData.lightmap.page === number) made.lightMap = placed(texture, made.userData.place);
      }
    });
  }

  /** Where a coordinate of a mesh's second set is on its page: instances of one mesh have a place each. */
  onPage(mesh, u, v) {
    const { scale, offset } = placeOf(mesh) ?? { scale: [1, 1], offset: [0, 0] };
    return [u * scale[0] + offset[0], v * scale[1] + offset[1]];
  }

  /** The irradiance [W/m²] at a lightmap coordinate of a page: texel H/π times π, bilinear. */
  irradiance(pageNumber, u, v) {
    const page = this.pages[pageNumber], colors = colorsOf(page);
    const x = clamp(u * page.width - 0.5, page.width), y = clamp(v * page.height - 0.5, page.height);
    const [x0, y0] = [Math.floor(x), Math.floor(y)];
    const found = [0, 0, 0];
    for (const [px, py, weight] of [
      [x0, y0, (x0 + 1 - x) * (y0 + 1 - y)], [x0 + 1, y0, (x - x0) * (y0 + 1 - y)],
      [x0, y0 + 1, (x0 + 1 - x) * (y - y0)], [x0 + 1, y0 + 1, (x - x0) * (y - y0)],
    ]) {
      const texel = 4 * (Math.min(py, page.height - 1) * page.width + Math.min(px, page.width - 1));
      for (let c = 0; c < 3; c++) found[c] += Math.PI * weight * colors[texel + c];
    }
    return found;
  }
}

/** The scale and offset of a mesh that instances share: on its node, which a mesh of several materials is below. */
function placeOf(mesh) {
  return [mesh, mesh.parent].map((each) => each?.userData.lightmap).find((told) => told?.scale) ?? null;
}

/** A texture at a place: a clone, which shares the image. */
function placed(texture, place) {
  if (!place) return texture;
  const clone = texture.clone();
  clone.repeat.fromArray(place.scale);
  clone.offset.fromArray(place.offset);
  clone.needsUpdate = true;
  return clone;
}

function clamp(value, count) {
  return Math.min(Math.max(value, 0), count - 1);
}

/** Lambert: base color, cut-outs and emission of a material, nothing that shines. */
function matteOf(material) {
  const { name, color, map, alphaMap, alphaTest, transparent, opacity, side, vertexColors } = material;
  const made = new MeshLambertMaterial({
    name, map, alphaMap, alphaTest, transparent, opacity, side, vertexColors, color: color?.clone(),
    emissive: material.emissive?.clone(), emissiveMap: material.emissiveMap,
    emissiveIntensity: material.emissiveIntensity,
  });
  made.userData = material.userData;
  return made;
}

/** Read a KTX2 file of RGB9E5: { width, height, packed }, rows from the top. */
export async function readKtx2(buffer) {
  const view = new DataView(buffer);
  const [format, width, height, scheme] = [12, 20, 24, 44].map((place) => view.getUint32(place, true));
  if (view.getUint32(0, true) !== 0x58544bab || format !== E5B9G9R9) throw new Error('not a KTX2 file of RGB9E5');
  const [offset, size, full] = [80, 88, 96].map((place) => Number(view.getBigUint64(place, true)));
  let data = new Uint8Array(buffer, offset, size);
  if (scheme === 2) {
    zstd ??= new ZSTDDecoder();
    await zstd.init();
    data = zstd.decode(data, full);
  }
  return { width, height, packed: new Uint32Array(data.slice().buffer), colors: null };
}

/** Read a PNG of RGBM: { width, height, colors }, rows from the top. Browsers' own decoders multiply by alpha. */
export async function readRgbm(buffer, range) {
  const view = new DataView(buffer), parts = [];
  if (view.getUint32(0) !== 0x89504e47) throw new Error('not a PNG file');
  const [width, height, kind] = [view.getUint32(16), view.getUint32(20), view.getUint32(24)];
  if (kind !== 0x08060000 || view.getUint8(28)) throw new Error('not a PNG file of 8 bits with alpha');
  for (let place = 8; place < buffer.byteLength; place += 12 + view.getUint32(place)) {
    if (view.getUint32(place + 4) === 0x49444154) parts.push(new Uint8Array(buffer, place + 8, view.getUint32(place)));
  }
  const packed = new Blob(parts).stream().pipeThrough(new DecompressionStream('deflate'));
  const data = new Uint8Array(await new Response(packed).arrayBuffer());
  const row = 4 * width, bytes = new Uint8Array(row * height), colors = new Float32Array(row * height);
  for (let y = 0; y < height; y++) {
    const filter = data[y * (row + 1)];
    for (let x = 0; x < row; x++) {
      const at = y * row + x;
      const a = x < 4 ? 0 : bytes[at - 4], b = y ? bytes[at - row] : 0, c = x < 4 || !y ? 0 : bytes[at - row - 4];
      bytes[at] = data[at + y + 1] + [0, a, b, (a + b) >> 1, paeth(a, b, c)][filter];
    }
  }
  for (let at = 0; at < bytes.length; at += 4) {
    const unit = range * bytes[at + 3] / 255 ** 2;
    colors.set([bytes[at] * unit, bytes[at + 1] * unit, bytes[at + 2] * unit, 1], at);
  }
  return { width, height, colors };
}

function paeth(a, b, c) {
  const [toA, toB, toC] = [b - c, a - c, a + b - 2 * c].map(Math.abs);
  return toA <= toB && toA <= toC ? a : toB <= toC ? b : c;
}

/** The colors of a page as floats, four a texel; decoded once. */
export function colorsOf(page) {
  if (page.colors) return page.colors;
  const colors = page.colors = new Float32Array(4 * page.packed.length);
  page.packed.forEach((bits, texel) => {
    const unit = 2 ** ((bits >>> 27) - 24);
    colors.set([(bits & 511) * unit, (bits >>> 9 & 511) * unit, (bits >>> 18 & 511) * unit, 1], 4 * texel);
  });
  return colors;
}

function textureOf(page) {
  if (!page.packed) return prepared(new DataTexture(page.colors, page.width, page.height, RGBAFormat, FloatType));
  return prepared(new DataTexture(page.packed, page.width, page.height, RGBFormat, UnsignedInt5999Type));
}

function prepared(texture) {
  texture.channel = 1;
  texture.colorSpace = NoColorSpace; // three.js takes float images as linear
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.generateMipmaps = false;
  texture.needsUpdate = true;
  return texture;
}
