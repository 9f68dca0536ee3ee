// WebGL 2, thinly.
const compile = (gl, kind, text) => {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  return shader;
};

class GlProgram {
  constructor(gl, name, vertex, fragment) {
    this.gl = gl;
    this.id = gl.createProgram();
    const shaders = [compile(gl, gl.VERTEX_SHADER, vertex), compile(gl, gl.FRAGMENT_SHADER, fragment)];
    for (const shader of shaders) gl.attachShader(this.id, shader);
    gl.linkProgram(this.id);
    if (!gl.getProgramParameter(this.id, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(
          "the " + name + " shader: " + shaders.map((s) => gl.getShaderInfoLog(s)).join("") +
          gl.getProgramInfoLog(this.id));
    for (const shader of shaders) gl.deleteShader(shader);
    this.places = new Map();
    this.units = new Map();
  }
  place(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.id, name));
    return this.places.get(name);
  }
  use() {
    this.gl.useProgram(this.id);
  }
  int(name, ...v) {
    const p = this.place(name);
    if (p !== null) this.gl["uniform" + v.length + "i"](p, ...v);
  }
  float(name, ...v) {
    const p = this.place(name);
    if (p !== null) this.gl["uniform" + v.length + "f"](p, ...v);
  }
  // m: rows one after another.
  matrix(name, m) {
    const p = this.place(name);
    if (p !== null) this.gl.uniformMatrix3fv(p, false, transposed(m));
  }
  // A texture unit each, in the order of the first use.
  texture(name, kind, id) {
    const p = this.place(name);
    if (p === null) return;
    if (!this.units.has(name)) {
      this.units.set(name, this.units.size);
      this.gl.uniform1i(p, this.units.get(name));
    }
    this.gl.activeTexture(this.gl.TEXTURE0 + this.units.get(name));
    this.gl.bindTexture(kind, id);
  }
}

const nearestTexture = (gl, kind) => {
  const id = gl.createTexture();
  gl.bindTexture(kind, id);
  for (const p of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(kind, p, gl.NEAREST);
  for (const p of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(kind, p, gl.CLAMP_TO_EDGE);
  return id;
};

// A buffer that shaders read: rows of rowTexels texels of four (or one) values, as FETCH has it.
class RowTexture {
  constructor(gl, rowTexels, format) {
    Object.assign(this, {gl, rowTexels, format, rows: 0, id: null});
  }
  set(values) {
    const {gl, rowTexels} = this;
    const [internal, outer, type, channels] = {
      rgba32f: [gl.RGBA32F, gl.RGBA, gl.FLOAT, 4],
      r32f: [gl.R32F, gl.RED, gl.FLOAT, 1],
      rgba32ui: [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, 4],
    }[this.format];
    const rows = Math.max(1, Math.ceil(values.length / (channels * rowTexels)));
    let padded = values;
    if (values.length !== rows * rowTexels * channels) {
      padded = new values.constructor(rows * rowTexels * channels);
      padded.set(values);
    }
    if (rows !== this.rows) {
      if (this.id) gl.deleteTexture(this.id);
      this.id = nearestTexture(gl, gl.TEXTURE_2D);
      gl.texStorage2D(gl.TEXTURE_2D, 1, internal, rowTexels, rows);
      this.rows = rows;
    }
    gl.bindTexture(gl.TEXTURE_2D, this.id);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, rowTexels, rows, outer, type, padded);
  }
}

// Textures of one size to draw into, and depth where wanted.
class Target {
  constructor(gl, internals, options = {}) {
    Object.assign(this, {gl, internals, options, size: [0, 0], textures: [], framebuffer: null, depth: null});
  }
  resize(width, height) {
    const {gl} = this;
    if (width === this.size[0] && height === this.size[1]) return;
    this.free();
    this.size = [width, height];
    this.framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    if (this.options.layers) {
      const id = nearestTexture(gl, gl.TEXTURE_2D_ARRAY);
      gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, this.internals[0], width, height, this.internals.length);
      this.textures = [id];
      this.internals.forEach((_, i) => gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, id, 0, i));
    } else {
      this.textures = this.internals.map((internal, i) => {
        const id = nearestTexture(gl, gl.TEXTURE_2D);
        gl.texStorage2D(gl.TEXTURE_2D, 1, internal, width, height);
        if (this.options.linear)
          for (const p of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, p, gl.LINEAR);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, id, 0);
        return id;
      });
    }
    if (this.options.depth) {
      this.depth = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, this.depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT32F, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.depth);
    }
    gl.drawBuffers(this.internals.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
    const status = gl.checkFramebufferStatus(gl.FRAMEBUFFER);
    if (status !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost())
      throw new Error("this browser cannot draw into the textures that are needed (" + status.toString(16) + ")");
  }
  bind() {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.framebuffer);
    this.gl.viewport(0, 0, ...this.size);
  }
  free() {
    if (!this.framebuffer) return;
    this.gl.deleteFramebuffer(this.framebuffer);
    this.textures.forEach((id) => this.gl.deleteTexture(id));
    if (this.depth) this.gl.deleteRenderbuffer(this.depth);
    this.framebuffer = this.depth = null;
  }
}
