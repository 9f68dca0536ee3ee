// The picture of one view: the proxy's depth, the photos of each cell of the view (spread, sample, gather: the
// browser's PlanCandidates), and the blend, whose text is the renderer's own (render/gl). Everything relative to the
// view's centre, differences formed in double.

const kSpare = 3;  // photos a sample lists beyond k (kSpareCandidates)

class LumigraphRenderer {
  constructor(gl, manifest, photos, corners, textureSide) {
    Object.assign(this, {gl, manifest, photos});
    if (!gl.getExtension("EXT_color_buffer_float"))
      throw new Error(
          "this browser's WebGL cannot draw floating-point numbers (EXT_color_buffer_float), which the renderer needs");
    this.programs = new Map();
    this.count = manifest.photos.length;
    this.columns = manifest.visibility ? LumigraphRenderer.mapColumns(manifest, textureSide) : 0;
    this.empty = gl.createVertexArray();
    this.mesh = gl.createVertexArray();
    this.cornerCount = corners.length / 6;
    gl.bindVertexArray(this.mesh);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    for (const i of [0, 1]) {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 24, 12 * i);
    }
    gl.bindVertexArray(null);
    const t = manifest.shaders.row_texels;
    this.cameras = new RowTexture(gl, t, "rgba32f");
    this.places = new RowTexture(gl, t, "rgba32ui");
    this.fields = new RowTexture(gl, t, "r32f");
    this.colors = new RowTexture(gl, t, "rgba32f");
    this.leaves = new RowTexture(gl, t, "r32f");
    this.leaves.set(new Float32Array(manifest.leaves ? manifest.leaves.table : [0]));
    const colors = new Float32Array(4 * this.count);
    manifest.photos.forEach((p, j) => colors.set([...p.color, 1], 4 * j));
    this.colors.set(colors);
    this.fields.set(new Float32Array([0]));
    this.depth = new Target(gl, [gl.RGBA32F], {depth: true});
    this.spread = new Target(gl, [gl.RGBA8UI]);
    this.picture = new Target(gl, [gl.RGBA8], {linear: true});
    this.placesVersion = -1;
    this.noPhotos = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.noPhotos);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA8, 1, 1, 1);
    this.sees = null;
    this.cells = [0, 0];
  }
  setFields(values) {
    this.fields.set(values);
  }

  // What is switched on. settings: the manifest's, with changes.
  defines(settings, show) {
    const s = settings, out = [];
    out.push("K " + s.k, "GROUPS " + Math.max(1, this.photos.groups.length), "LISTED " + Math.min(16, s.k + kSpare));
    out.push("CELLS");
    if (show === "false-color") out.push("FALSE_COLOR");
    if (this.photos.whole) out.push("WHOLE_LAYERS");
    if (s.falling_leaves) out.push("FALLING_LEAVES");
    if (s.field_of_view) out.push("FIELD_OF_VIEW");
    if (s.visibility && this.manifest.visibility) out.push("VISIBILITY", "MAP_COLUMNS " + this.columns);
    let stretch = false, photoTerms = false;
    for (const term of this.manifest.terms) {
      if (!s.terms[term.name]) continue;
      if (term.define)
        out.push(term.define);
      else
        photoTerms = true;
      stretch ||= term.reads_stretch;
    }
    if (stretch) out.push(s.jacobian ? "STRETCH_BY_JACOBIAN" : "STRETCH_BY_DISTANCE");
    if (photoTerms) out.push("PHOTO_TERMS");
    const exposure = s.exposure && show !== "false-color", prefilter = s.prefilter && show !== "false-color";
    if (exposure) out.push("EXPOSURE");
    if (prefilter) out.push("PREFILTER");
    if (prefilter || (stretch && s.jacobian)) out.push("FACES");
    this.rows = photoTerms || exposure ? 5 : 4;
    out.push("CAMERA_ROWS " + this.rows);
    return out.map((d) => "#define " + d + "\n").join("");
  }
  program(kind, defines) {
    const key = kind + "\n" + defines;
    if (this.programs.has(key)) return this.programs.get(key);
    const s = this.manifest.shaders, page = pageShaders;
    const head = s.version + s.constants + defines;
    const core = s.cameras + s.measures + s.rays;
    const text = {
      depth: [head + page["depth.vert"], head + page["depth.frag"]],
      spread: [
        s.version + page["screen.vert"],
        head + "const float kInfinity = 3.0e38;\n" + page["probes.glsl"] + page["spread.frag"]
      ],
      lattice: [
        s.version + page["screen.vert"], head + "#define LATTICE\n" + core + page["probes.glsl"] + page["sample.frag"]
      ],
      between: [s.version + page["screen.vert"], head + core + page["probes.glsl"] + page["sample.frag"]],
      gather: [
        s.version + page["screen.vert"], head + "#define GATHERED " + 4 * this.gatherLayers + "\n" + page["gather.frag"]
      ],
      blend: [s.version + page["screen.vert"], head + core + s.photos + s.blending],
      present: [s.version + page["screen.vert"], s.version + page["present.frag"]],
    }[kind];
    const program = new GlProgram(this.gl, kind, ...text);
    this.programs.set(key, program);
    return program;
  }

  drawScreen(target) {
    const {gl} = this;
    if (target) target.bind();
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  // The proxy from a camera {m, centre, size} into the bound framebuffer.
  drawProxy(camera) {
    const {gl} = this,
          program = this.program("depth", "#define NEAR_DEPTH " + this.manifest.near_depth.toExponential() + "\n");
    const [w, h] = camera.size;
    const clip = times([2 / w, 0, -1, 0, 2 / h, -1, 0, 0, 1], camera.m);
    program.use();
    program.float("centre", ...camera.centre);
    program.matrix("clip_from_offset", clip);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.GREATER);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.bindVertexArray(this.mesh);
    gl.drawArrays(gl.TRIANGLES, 0, this.cornerCount);
    gl.disable(gl.DEPTH_TEST);
  }

  // How many depth maps stand side by side, in a texture that is about square; 0: it would be larger than textureSide.
  static mapColumns(manifest, textureSide) {
    const [w, h] = manifest.visibility.size, n = manifest.photos.length;
    const columns = Math.min(Math.ceil(Math.sqrt((n * h) / w)), Math.floor(textureSide / w));
    return columns > 0 && h * Math.ceil(n / columns) <= textureSide ? columns : 0;
  }
  // What stays on the graphics processor beside photos: the proxy, and what each photo sees of it.
  static bytesFor(manifest, corners) {
    const [w, h] = manifest.visibility ? manifest.visibility.size : [0, 0];
    return corners.byteLength + 4 * w * h * manifest.photos.length;
  }

  // Depth maps of what photos see of the proxy: of those that are there and have none yet.
  addVisibility() {
    const {gl, manifest} = this;
    if (!manifest.visibility) return;
    const [w, h] = manifest.visibility.size, {columns} = this;
    if (!this.sees) {
      this.sees = nearestTexture(gl, gl.TEXTURE_2D);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32F, w * columns, h * Math.ceil(this.count / columns));
      this.oneMap = new Target(gl, [gl.R32F], {depth: true});
      this.oneMap.resize(w, h);
      this.mapped = new Uint8Array(this.count);
    }
    manifest.photos.forEach((p, j) => {
      if (this.mapped[j] || this.photos.levelOf(j) < 0) return;
      this.mapped[j] = 1;
      this.oneMap.bind();
      gl.clearBufferfv(gl.COLOR, 0, [3e38, 0, 0, 0]);
      gl.clearBufferfv(gl.DEPTH, 0, [0]);
      this.drawProxy({m: p.m, centre: p.centre, size: p.size});
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, this.sees);
      gl.copyTexSubImage2D(gl.TEXTURE_2D, 0, (j % columns) * w, Math.floor(j / columns) * h, 0, 0, w, h);
    });
  }

  // Camera rows (PackCameras of render/gl/gl_uploads.cc), photo for photo.
  setCameras(view, settings) {
    const rows = new Float32Array(4 * this.rows * this.count);
    const gain = view.gain ?? 1;
    this.manifest.photos.forEach((p, j) => {
      const at = 4 * this.rows * j, m = p.m;
      rows[at] = p.centre[0] - view.centre[0];
      rows[at + 1] = p.centre[1] - view.centre[1];
      rows[at + 2] = p.centre[2] - view.centre[2];
      rows[at + 3] = p.size[0];
      rows.set(
          [
            m[0], m[1], m[2], p.size[1], m[3], m[4], m[5], settings.feather * Math.min(...p.size), m[6], m[7], m[8],
            p.focal_px
          ],
          at + 4);
      if (this.rows > 4) rows.set([photoTerms(this.manifest, settings, p, view), gain / p.gain, 0, 0], at + 16);
    });
    this.cameras.set(rows);
    if (this.placesVersion !== this.photos.version) {
      this.places.set(this.photos.places());
      this.placesVersion = this.photos.version;
    }
  }

  // Photos whose centres lie in a cell, up to four of each.
  setEpipoles(view) {
    const {gl} = this, [columns, rows] = this.cells, [w, h] = view.size;
    const ids = new Uint16Array(4 * columns * rows);
    this.manifest.photos.forEach((p, j) => {
      if (this.photos.levelOf(j) < 0) return;
      let e = timesVector(view.m, sub(p.centre, view.centre));
      if (e[2] < 0) e = scaled(e, -1);
      if (!(e[2] > 0 && e[0] >= 0 && e[1] >= 0 && e[0] <= w * e[2] && e[1] <= h * e[2])) return;
      const x = Math.min(columns - 1, Math.floor((e[0] / e[2] / w) * columns)),
            y = Math.min(rows - 1, Math.floor((e[1] / e[2] / h) * rows));
      const at = 4 * (y * columns + x);
      for (let i = 0; i < 4; ++i)
        if (ids[at + i] === 0) {
          ids[at + i] = j + 1;
          break;
        }
    });
    if (!this.epipoles || this.epipoleCells !== columns + "x" + rows) {
      if (this.epipoles) gl.deleteTexture(this.epipoles);
      this.epipoles = nearestTexture(gl, gl.TEXTURE_2D);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16UI, columns, rows);
      this.epipoleCells = columns + "x" + rows;
    }
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.epipoles);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, columns, rows, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, ids);
  }

  setShared(program, view, settings) {
    const {gl} = this;
    program.use();
    program.matrix("ray_from_pixel", inverse(view.m));
    program.matrix("view_from_offset", view.m);
    program.int("camera_count", this.count);
    program.float("alpha_weight", settings.alpha);
    program.float("gamma", settings.gamma);
    const focal = Math.sqrt(Math.abs(determinant(view.m)));
    program.float("focal_px", focal);
    program.float("view_focal_px", focal);
    program.int("cell_count", ...this.cells);
    program.int("size_px", ...view.size);
    program.float("cells_per_px", this.cells[0] / view.size[0], this.cells[1] / view.size[1]);
    if (this.manifest.visibility) program.int("visibility_size", ...this.manifest.visibility.size);
    if (this.manifest.leaves) {
      program.float("leaf_place", ...this.manifest.leaves.place);
      program.float("r_max", this.manifest.leaves.r_max);
    }
    for (const term of this.manifest.terms) {
      if (!term.define) continue;
      program.float(term.name + "_scale", term.scale);
      program.float(term.name + "_shape", ...term.shape);
      program.int(term.name + "_field", ...term.field);
    }
    program.texture("depth_map", gl.TEXTURE_2D, this.depth.textures[0]);
    program.texture("cameras", gl.TEXTURE_2D, this.cameras.id);
    program.texture("places", gl.TEXTURE_2D, this.places.id);
    program.texture("photo_fields", gl.TEXTURE_2D, this.fields.id);
    program.texture("source_colors", gl.TEXTURE_2D, this.colors.id);
    program.texture("leaves", gl.TEXTURE_2D, this.leaves.id);
    program.texture("visibility_maps", gl.TEXTURE_2D, this.sees);
    program.texture("spreads", gl.TEXTURE_2D, this.spread.textures[0]);
  }

  // view: {m (pixels from directions, third row unit), centre, size, gain, time_s}. The picture lies in this.picture.
  render(view, settings, show) {
    const {gl} = this, defines = this.defines(settings, show);
    this.addVisibility();
    const [w, h] = view.size;
    this.depth.resize(w, h);
    this.depth.bind();
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [0]);
    this.drawProxy(view);
    if (show === "depth") return;
    this.setCameras(view, settings);
    this.cells = [Math.max(1, Math.round(w / settings.cell_px)), Math.max(1, Math.round(h / settings.cell_px))];
    this.gatherLayers = gl.getParameter(gl.MAX_DRAW_BUFFERS) >= 8 ? 8 : 4;
    const [columns, rows] = this.cells, lists = Math.ceil(Math.min(16, settings.k + kSpare) / 4);
    if (this.listCount !== lists) {
      for (const t of [this.lattice, this.between, this.gathered]) t?.free();
      this.lattice = new Target(gl, new Array(lists).fill(gl.RGBA16UI));
      this.between = new Target(gl, new Array(lists).fill(gl.RGBA16UI));
      this.gathered = new Target(gl, new Array(this.gatherLayers).fill(gl.RGBA16UI), {layers: true});
      this.listCount = lists;
    }
    this.setEpipoles(view);
    this.spread.resize(columns, rows);
    this.lattice.resize(2 * columns + 1, 2 * rows + 1);
    this.between.resize(2 * columns, 2 * rows);
    this.gathered.resize(columns, rows);
    this.picture.resize(w, h);
    const run = (kind, target, more) => {
      const program = this.program(kind, defines);
      this.setShared(program, view, settings);
      if (more) more(program);
      this.drawScreen(target);
    };
    run("spread", this.spread);
    run("lattice", this.lattice);
    run("between", this.between, (p) => p.texture("lattice", gl.TEXTURE_2D, this.lattice.textures[0]));
    run("gather", this.gathered, (p) => {
      p.texture("epipoles", gl.TEXTURE_2D, this.epipoles);
      for (let i = 0; i < lists; ++i) {
        p.texture("lattice" + i, gl.TEXTURE_2D, this.lattice.textures[i]);
        p.texture("between" + i, gl.TEXTURE_2D, this.between.textures[i]);
      }
    });
    run("blend", this.picture, (p) => {
      p.texture("lists", gl.TEXTURE_2D_ARRAY, this.gathered.textures[0]);
      this.photos.groups.forEach((g, i) => {
        p.texture("photos[" + i + "]", gl.TEXTURE_2D_ARRAY, g.id ?? this.noPhotos);
        p.int("group_size[" + i + "]", ...g.size);
      });
      if (this.photos.groups.length === 0) p.texture("photos[0]", gl.TEXTURE_2D_ARRAY, this.noPhotos);
    });
  }

  // On the canvas.
  present(width, height, ground, show) {
    const {gl} = this, program = this.program("present", "");
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    program.use();
    program.texture("picture", gl.TEXTURE_2D, this.picture.textures[0] ?? null);
    program.texture("depth_map", gl.TEXTURE_2D, this.depth.textures[0]);
    program.float("canvas_px", width, height);
    program.float("ground", ...ground);
    program.int("proxy", show === "depth" ? 1 : 0);
    this.drawScreen(null);
  }

  // RGBA, rows from the top, premultiplied.
  readPicture() {
    const {gl} = this, [w, h] = this.picture.size, pixels = new Uint8Array(4 * w * h);
    this.picture.bind();
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  }
  // Depth of the proxy at a pixel; 0: none.
  depthAt(x, y) {
    const {gl} = this, texel = new Float32Array(4);
    this.depth.bind();
    gl.readPixels(x, y, 1, 1, gl.RGBA, gl.FLOAT, texel);
    return texel[0];
  }
}

// Terms of h that are a photo's own: how far it is in time (render/radiance/measures/time.h).
const photoTerms = (manifest, settings, photo, view) => {
  let sum = 0;
  for (const term of manifest.terms) {
    if (term.define || !settings.terms[term.name] || photo.time_s === undefined) continue;
    const s = term.time;
    let dt = Math.abs((view.time_s ?? 0) - photo.time_s);
    if (s.period_s > 0) dt = Math.abs(dt - s.period_s * Math.floor(dt / s.period_s + 0.5));
    const at = (2 * dt) / s.window_s, core = (at - s.core) / (1 - s.core);
    const raised = Math.sin((Math.PI / 2) * Math.min(1, Math.max(0, core))) ** 2;
    sum += term.scale * (at > 1 ? at : s.least + (1 - s.least) * raised);
  }
  return sum;
};
