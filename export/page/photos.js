// Photos as layers of array textures, one array for each size of photo and level of detail. Which photos are there, and
// how sharp, follows from the view: the nearest first, as many as --memory-mb lets stay.

// One axis averaged over half as many places, floor(n / 2) of them, each over n / floor(n / 2) of the old ones.
const halvedAxis = (source, count, stride, lines, lineStride, target, targetStride, targetLineStride) => {
  const half = Math.max(1, count >> 1), step = count / half;
  for (let i = 0; i < half; ++i) {
    const from = i * step, to = (i + 1) * step;
    const first = Math.floor(from), last = Math.min(count - 1, Math.ceil(to) - 1);
    for (let l = 0; l < lines; ++l)
      for (let c = 0; c < 4; ++c) {
        let sum = 0;
        for (let k = first; k <= last; ++k)
          sum += source[k * stride + l * lineStride + c] * (Math.min(k + 1, to) - Math.max(k, from));
        target[i * targetStride + l * targetLineStride + c] = sum / step;
      }
  }
};

// As BuildPyramid of scene/files/image_io.h: each level the mean of 2 x 2 of the last one.
const pyramidOf = (pixels, width, height) => {
  const levels = [{pixels, width, height}];
  while (width > 1 || height > 1) {
    const last = levels[levels.length - 1].pixels;
    const w = Math.max(1, width >> 1), h = Math.max(1, height >> 1);
    const next = new Uint8Array(4 * w * h);
    if (width % 2 === 0 && height % 2 === 0) {
      const pitch = 4 * width;
      for (let y = 0, out = 0; y < h; ++y)
        for (let x = 0, at = 2 * y * pitch; x < w; ++x, at += 8)
          for (let c = 0; c < 4; ++c, ++out) {
            const i = at + c;
            next[out] = (last[i] + last[i + 4] + last[i + pitch] + last[i + pitch + 4] + 2) >> 2;
          }
    } else {
      const across = new Float32Array(4 * w * height), down = new Float32Array(4 * w * h);
      halvedAxis(last, width, 4, height, 4 * width, across, 4, 4 * w);
      halvedAxis(across, height, 4 * w, w, 4, down, 4 * w, 4);
      for (let i = 0; i < next.length; ++i) next[i] = Math.min(255, Math.round(down[i]));
    }
    levels.push({pixels: next, width: w, height: h});
    width = w;
    height = h;
  }
  return levels;
};

const decodePixels = async (bytes, [width, height]) => {
  const bitmap = await createImageBitmap(
      new Blob([bytes], {type: "image/jpeg"}), {colorSpaceConversion: "none", premultiplyAlpha: "none"});
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d", {willReadFrequently: true});
  context.imageSmoothingQuality = "high";
  context.drawImage(bitmap, 0, 0, width, height);
  bitmap.close();
  return new Uint8Array(context.getImageData(0, 0, width, height).data.buffer);
};

class GraphicsMemoryFull extends Error {}

// Layers of photos of one size.
class PhotoGroup {
  constructor(gl, index, size, layers) {
    Object.assign(this, {gl, index, size, layers, owner: new Array(layers).fill(-1), id: null});
    this.levels = 1 + Math.floor(Math.log2(Math.max(...size)));
  }
  static bytesPerLayer(size) {
    return Math.ceil((size[0] * size[1] * 16) / 3);
  }
  get bytes() {
    return this.id ? this.layers * PhotoGroup.bytesPerLayer(this.size) : 0;
  }
  upload(layer, pyramid) {
    const {gl} = this;
    gl.activeTexture(gl.TEXTURE0);
    if (!this.id) {
      this.id = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.id);
      gl.texStorage3D(gl.TEXTURE_2D_ARRAY, this.levels, gl.RGBA8, ...this.size, this.layers);
      if (gl.getError() === gl.OUT_OF_MEMORY) {
        gl.deleteTexture(this.id);
        this.id = null;
        throw new GraphicsMemoryFull("the graphics memory is full");
      }
      gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
      gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
      for (const p of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T])
        gl.texParameteri(gl.TEXTURE_2D_ARRAY, p, gl.CLAMP_TO_EDGE);
    }
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.id);
    pyramid.slice(0, this.levels)
        .forEach(
            (level, i) => gl.texSubImage3D(
                gl.TEXTURE_2D_ARRAY, i, 0, 0, layer, level.width, level.height, 1, gl.RGBA, gl.UNSIGNED_BYTE,
                level.pixels));
  }
}

const kMostGroups = 6;
const kAtOnce = 3;    // photos on their way
const kFirst = 8;     // photos of the first picture
const kNearest = 24;  // photos that come first, small where they may be
const kTries = 4;    // of a photo while there is no network: pauses of 0.5, 2 and 8 s

class Photos {
  // Photos wider or higher than textureSide are halved until they are not. changed: called when a photo arrived or left.
  constructor(gl, manifest, memoryBytes, textureSide, changed) {
    Object.assign(
        this,
        {gl, manifest, changed, failed: 0, outOfMemory: false, onTheirWay: 0, stopped: false, begun: false});
    for (const level of manifest.photos.flatMap((about) => about.levels))
      while (Math.max(...level.size) > textureSide) {
        level.size = level.size.map((side) => Math.max(1, side >> 1));
        ++level.shift;
      }
    this.photos = manifest.photos.map(
        (about) => ({about, detail: about.levels.map(() => ({group: null, layer: -1, loading: false}))}));
    this.groups = [];
    this.version = 0;
    this.plan(memoryBytes);
    this.setOrder(this.photos.map((_, j) => j));
  }

  // Arrays for each size and level. Where not all photos fit in full, the sharp ones are as many as do, and every photo
  // has a smaller one where the page has it.
  plan(memoryBytes) {
    const {gl} = this;
    const most = Math.min(2048, gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS));
    const classes = new Map();
    this.photos.forEach(({about}, j) => about.levels.forEach((level, l) => {
      const key = level.size.join("x") + "/" + l;
      if (!classes.has(key)) classes.set(key, {size: level.size, level: l, photos: []});
      classes.get(key).photos.push(j);
    }));
    const all = [...classes.values()].sort((a, b) => b.level - a.level);
    while (all.length > kMostGroups) this.mergeCheapest(all);
    let left = memoryBytes;
    for (const c of all) {
      const bytes = PhotoGroup.bytesPerLayer(c.size);
      const wanted = c.photos.length;
      // What the sharper ones of other sizes may take is shared by their numbers.
      const rest = all.filter((o) => o.level === c.level && !o.layers).reduce((sum, o) => sum + o.photos.length, 0);
      const share = c.level > 0 ? left : left * (wanted / rest);
      c.layers = Math.max(Math.min(16, wanted), Math.min(wanted, most, Math.floor(share / bytes)));
      left = Math.max(0, left - c.layers * bytes);
      c.group = new PhotoGroup(gl, this.groups.length, c.size, c.layers);
      this.groups.push(c.group);
      for (const j of c.photos) this.photos[j].detail[c.level].group = c.group;
    }
    this.whole =
        all.every((c) => c.photos.every((j) => this.photos[j].about.levels[c.level].size.join() === c.size.join()));
  }
  mergeCheapest(all) {
    let best = null;
    for (let a = 0; a < all.length; ++a)
      for (let b = a + 1; b < all.length; ++b) {
        if (all[a].level !== all[b].level) continue;
        const size = [0, 1].map((i) => Math.max(all[a].size[i], all[b].size[i]));
        const cost = (size[0] * size[1] - all[a].size[0] * all[a].size[1]) * all[a].photos.length +
            (size[0] * size[1] - all[b].size[0] * all[b].size[1]) * all[b].photos.length;
        if (best === null || cost < best.cost) best = {a, b, size, cost};
      }
    if (best === null) return all.pop();
    all[best.a] = {size: best.size, level: all[best.a].level, photos: [...all[best.a].photos, ...all[best.b].photos]};
    all.splice(best.b, 1);
  }

  get bytes() {
    return this.groups.reduce((sum, g) => sum + g.bytes, 0);
  }
  // The sharpest that is there; -1: none.
  levelOf(j) {
    return this.photos[j].detail.findIndex((d) => d.layer >= 0);
  }
  get loadedCount() {
    return this.photos.reduce((n, _, j) => n + (this.levelOf(j) >= 0), 0);
  }
  // Whether the k nearest are there, each as sharp or small as it may be; kFirst of them where k is more, or 0 (all).
  hasNearest(k) {
    return this.order.slice(0, k > 0 ? Math.min(k, kFirst) : kFirst)
        .every((j) => this.levelOf(j) >= 0 || this.photos[j].about.failed || this.outOfMemory);
  }
  get finished() {
    return this.begun && this.onTheirWay === 0 && this.next() === null;
  }

  // x: size, y: group, top level, shift, z: layer, w: photo (render/gl/measures_shader.cc).
  places() {
    const texels = new Uint32Array(4 * this.photos.length);
    this.photos.forEach(({about, detail}, j) => {
      const l = this.levelOf(j);
      if (l < 0) return;
      const {group, layer} = detail[l], [w, h] = about.levels[l].size;
      const top = Math.min(Math.floor(Math.log2(Math.max(w, h))), group.levels - 1);
      texels.set([w | (h << 16), group.index | (top << 8) | (about.levels[l].shift << 16), layer, j], 4 * j);
    });
    return texels;
  }

  // The nearest first. `rank`: each photo's place in it.
  setOrder(order) {
    this.order = order;
    this.rank = new Int32Array(order.length);
    order.forEach((photo, i) => {
      this.rank[photo] = i;
    });
  }
  lacks(j, l) {
    const {about, detail} = this.photos[j];
    return detail[l].layer < 0 && !detail[l].loading && !about.failed;
  }

  // What to load, as [photo, level]: small ones of the nearest, then sharp ones of as many as there are layers for,
  // then small ones of the rest. null: nothing is left.
  next() {
    const small = (j) => this.photos[j].detail.length - 1;
    const blank = (j) => this.levelOf(j) < 0 && this.lacks(j, small(j)) && this.freeLayer(j, small(j)) >= 0;
    const first = this.order.slice(0, this.begun ? kNearest : kFirst).find(blank);
    if (first !== undefined) return [first, small(first)];
    if (!this.begun) return null;  // the first picture does not wait for more
    const used = new Map();
    for (const j of this.order) {
      const {group} = this.photos[j].detail[0], n = used.get(group) ?? 0;
      if (n >= group.layers) continue;
      used.set(group, n + 1);
      if (this.lacks(j, 0)) return [j, 0];
    }
    // Those without a small one have had their turn.
    const rest = this.order.find((j) => small(j) > 0 && blank(j));
    return rest === undefined ? null : [rest, small(rest)];
  }
  // A layer of nobody, or of who is farthest from the view, if that is farther than this one; -1: none.
  freeLayer(j, l) {
    const {group} = this.photos[j].detail[l];
    const free = group.owner.indexOf(-1);
    if (free >= 0) return free;
    let farthest = j, layer = -1;
    group.owner.forEach((photo, i) => {
      if (photo === j || this.photos[photo].detail[l].loading || this.rank[photo] <= this.rank[farthest]) return;
      farthest = photo;
      layer = i;
    });
    return layer;
  }

  // The first picture has been drawn.
  begin() {
    this.begun = true;
    this.pump();
  }
  pump() {
    while (!this.stopped && this.onTheirWay < kAtOnce) {
      const wanted = this.next();
      if (wanted === null) return;
      this.load(...wanted);
    }
  }
  async load(j, l) {
    const {about, detail} = this.photos[j], of = detail[l];
    of.loading = true;
    ++this.onTheirWay;
    try {
      about.levels[l].bytesKept ??= await readPart(about.levels[l].part);
      const level = about.levels[l];
      if (of.group.layers === 0) throw new GraphicsMemoryFull("the graphics memory is full");
      const pixels = await decodePixels(level.bytesKept, level.size);
      if (!inPage) level.bytesKept = undefined;  // the browser's cache has it
      const layer = this.freeLayer(j, l);
      if (layer >= 0 && !this.stopped) {
        const before = of.group.owner[layer];
        if (before >= 0) this.photos[before].detail[l].layer = -1;
        of.group.upload(layer, pyramidOf(pixels, ...level.size));
        of.group.owner[layer] = j;
        of.layer = layer;
      }
    } catch (error) {
      // fetch throws a TypeError where there is no network: that may come back. A file that is not there does not.
      about.tries = (about.tries ?? 0) + 1;
      if (error instanceof TypeError && about.tries < kTries && !this.stopped) {
        await new Promise((resolve) => setTimeout(resolve, 500 * 4 ** (about.tries - 1)));
      } else {
        const full = error instanceof GraphicsMemoryFull;
        if (full) {
          this.outOfMemory = true;
          of.group.layers = 0;
          of.group.owner = [];
        }
        // Without sharp photos there are small ones, where the page has them.
        about.failed = !full || l === detail.length - 1;
        this.failed += about.failed ? 1 : 0;
        console.warn("photo " + j + ": " + error.message);
      }
    }
    of.loading = false;
    --this.onTheirWay;
    ++this.version;
    this.changed();
    this.pump();
  }
}
