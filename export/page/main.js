// From the manifest to a picture, and a picture for each movement.
const kLeastForPhotos = 0.25;  // of the memory, whatever else needs it

const start = async () => {
  const canvas = byId("view");
  const manifest = await readManifest();
  const gl = canvas.getContext(
      "webgl2",
      {alpha: false, antialias: false, depth: false, powerPreference: "high-performance", preserveDrawingBuffer: true});
  if (!gl)
    throw new Error(
        "This browser shows no WebGL 2, which this page draws with. Recent versions of Firefox, Chrome, Edge and Safari have it; it may be switched off in the settings, or the graphics driver may be missing.");
  const begun = performance.now();
  // A photo in the middle of all: what it sees is photographed.
  const middle = scaled(manifest.photos.reduce((sum, p) => add(sum, p.centre), [0, 0, 0]), 1 / manifest.photos.length);
  const home = PersonCamera.poseOf(
      manifest.photos.reduce((a, b) => (norm(sub(a.centre, middle)) <= norm(sub(b.centre, middle)) ? a : b)));
  const query = new URLSearchParams(location.search);
  // Of the graphics processor, for all that stays there.
  const memoryMb = Number(query.get("memory-mb")) || manifest.memory_mb ||
      (navigator.deviceMemory ? Math.min(1024, navigator.deviceMemory * 128) : 512);
  const camera = new PersonCamera(manifest);
  const state = {
    settings: JSON.parse(JSON.stringify(manifest.settings)),
    show: "color",
    overlay: false,
    playing: null,
    timeRuns: true,
    time_s: manifest.time?.begin_s,
    dirty: true,
    sharp: true,
    photo: -1
  };
  const frames = [];
  let renderer = null, lost = false;
  const touch = () => {
    state.dirty = true;
    state.sharp = false;
    state.moved = performance.now();
  };
  const corners = readMesh(await readPart("proxy.bin"), manifest.proxy);
  // No texture may be wider or higher.
  const asked = Number(query.get("texture-px"));
  const textureSide = Math.min(gl.getParameter(gl.MAX_TEXTURE_SIZE), asked >= 1 ? asked : Infinity);
  let lacking = "";
  if (manifest.visibility && LumigraphRenderer.mapColumns(manifest, textureSide) === 0) {
    manifest.visibility = undefined;
    lacking = "this device cannot hold what each photo sees: hidden things may shine through";
  }
  const besidePhotos = LumigraphRenderer.bytesFor(manifest, corners);
  const photosBytes = Math.max(kLeastForPhotos * memoryMb * 1e6, memoryMb * 1e6 - besidePhotos);
  const photos = new Photos(gl, manifest, photosBytes, textureSide, () => {
    state.dirty = true;
    showLoading();
  });
  const showLoading = () => {
    const n = photos.loadedCount, all = manifest.photos.length, done = photos.finished;
    byId("loading").firstElementChild.style.width = (100 * n) / all + "%";
    byId("loading").setAttribute("aria-valuenow", Math.round((100 * n) / all));
    byId("loading").classList.toggle("done", done);
    let said = photos.failed ? photos.failed + " photos could not be loaded" : lacking;
    if (photos.outOfMemory)
      said = "the graphics memory is full: ?memory-mb=" + Math.ceil(memoryMb / 2) + " in the address takes half";
    byId("status").textContent = done ? said : "loading photos: " + n + " of " + all;
  };

  // The photos nearest to a view, by the angle at points along five of its rays at the typical depth, and in time where
  // that counts; those that do not see the points after those that do.
  const orderFor = (view) => {
    const rays = inverse(view.m), [w, h] = view.size;
    const points = [[0.5, 0.5], [0.2, 0.2], [0.8, 0.2], [0.2, 0.8], [0.8, 0.8]].map(
        ([x, y]) => add(view.centre, scaled(timesVector(rays, [x * w, y * h, 1]), manifest.typical_depth)));
    const cost = manifest.photos.map((p) => {
      let sum = points.length * photoTerms(manifest, state.settings, p, view);
      for (const x of points) {
        const a = unit(sub(x, view.centre)), b = unit(sub(x, p.centre));
        sum += Math.acos(Math.min(1, Math.max(-1, dot(a, b))));
        const q = timesVector(p.m, sub(x, p.centre));
        if (!(q[2] > 0 && q[0] >= 0 && q[1] >= 0 && q[0] <= p.size[0] * q[2] && q[1] <= p.size[1] * q[2])) sum += 1;
      }
      return sum;
    });
    return cost.map((_, j) => j).sort((a, b) => cost[a] - cost[b]);
  };

  const jump = (j, seconds = 0.8) => {
    state.photo = (j + manifest.photos.length) % manifest.photos.length;
    stop();
    camera.flyTo(
        PersonCamera.poseOf(manifest.photos[state.photo]),
        matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : seconds, performance.now() / 1000);
    if (manifest.time && manifest.photos[state.photo].time_s !== undefined)
      state.time_s = manifest.photos[state.photo].time_s;
    markPhoto(state.photo);
    touch();
  };
  const stop = () => {
    state.playing = null;
    camera.flight = null;
    byId("play").setAttribute("aria-pressed", "false");
  };
  const setShow = (show) => {
    state.show = show;
    byId("show").value = show;
    state.dirty = true;
  };
  const toggle = (id) => {
    byId(id).hidden = !byId(id).hidden;
  };
  const actions = {
    jump,
    stop,
    set: (change) => {
      Object.assign(state.settings, change);
      state.dirty = true;
    },
    effect: (name, on) => {
      setEffect(state.settings, manifest, name, on);
      state.dirty = true;
    },
    show: setShow,
    mode: (mode) => {
      camera.mode = mode;
      byId("mode").value = mode;
    },
    overlay: (on) => {
      state.overlay = on;
      state.dirty = true;
    },
    cameras: () => {
      byId("cameras").checked = state.overlay = !state.overlay;
      state.dirty = true;
    },
    falseColor: () => setShow(state.show === "false-color" ? "color" : "false-color"),
    proxy: () => setShow(state.show === "depth" ? "color" : "depth"),
    photo: (step) => jump(state.photo < 0 ? orderFor(viewNow())[0] : state.photo + step),
    home: () => {
      stop();
      camera.flyTo(home, 0.8, performance.now() / 1000);
      touch();
    },
    play: () => {
      if (state.playing !== null) return stop();
      stop();
      state.playing = {begin: performance.now() / 1000, from: camera.pose};
      byId("play").setAttribute("aria-pressed", "true");
      touch();
    },
    link: async () => {
      const link = new URL(location.href);
      link.hash = "pose=" + poseText(camera.pose);
      history.replaceState(null, "", link.hash);
      try {
        await navigator.clipboard.writeText(link.href);
        byId("status").textContent = "link copied";
      } catch {
        byId("status").textContent = "the link is in the address bar";
      }
    },
    full: () =>
        (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen?.()),
    panel: () => {
      toggle("panel");
      byId("more").setAttribute("aria-expanded", String(!byId("panel").hidden));
    },
    help: () => toggle("help"),
    close: () => {
      byId("help").hidden = byId("panel").hidden = true;
      byId("more").setAttribute("aria-expanded", "false");
    },
    time: (share) => {
      state.timeRuns = byId("time-runs").checked = false;
      state.time_s = manifest.time.begin_s + share * (manifest.time.end_s - manifest.time.begin_s);
      state.dirty = true;
    },
    timeRuns: (on) => {
      state.timeRuns = on;
    },
    // The point under a double click becomes what the camera turns about.
    pivot: (x, y) => {
      const [w, h] = renderer.depth.size,
                d = renderer.depthAt(
                    Math.floor((x / canvas.clientWidth) * w), Math.floor((y / canvas.clientHeight) * h));
      if (!(d > 0)) return;
      const view = viewNow(), ray = timesVector(inverse(view.m), [
                                (x / canvas.clientWidth) * view.size[0], (y / canvas.clientHeight) * view.size[1], 1
                              ]);
      const to = add(camera.centre, scaled(ray, d)), distance = norm(sub(to, camera.centre));
      camera.pivotDistance = distance;
      camera.flyTo(
          {...camera.pose, rotation: lookingAlong(sub(to, camera.centre), camera.up)}, 0.5, performance.now() / 1000);
      touch();
    },
  };
  fillPanel(manifest, state, actions);
  const moveByKeys = attachControls(canvas, camera, actions, touch);

  // Pixels to draw: those of the screen, at most two a CSS pixel and two million; while something moves, as many as
  // keep frames below 40 ms.
  let movingScale = 1;
  const sizeNow = () => {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const w = Math.max(1, Math.round(canvas.clientWidth * ratio)),
          h = Math.max(1, Math.round(canvas.clientHeight * ratio));
    const scale = Math.min(1, Math.sqrt(2e6 / (w * h))) * (state.sharp ? 1 : movingScale);
    return {canvas: [w, h], picture: [Math.max(8, Math.round(w * scale)), Math.max(8, Math.round(h * scale))]};
  };
  const viewNow = () => {
    const view = camera.view(...sizeNow().picture);
    view.time_s = state.time_s;
    return view;
  };

  const makeRenderer = async () => {
    renderer = new LumigraphRenderer(gl, manifest, photos, corners, textureSide);
    if (manifest.fields) renderer.setFields(new Float32Array((await readPart("fields.bin")).buffer));
  };
  await makeRenderer();
  canvas.addEventListener("webglcontextlost", (e) => {
    e.preventDefault();
    lost = true;
    photos.stopped = true;
    say("The graphics processor gave this page's memory to somebody else. Reload to go on.");
  });

  const fromHash = () => {
    const hash = new URLSearchParams(location.hash.slice(1));
    if (hash.has("view")) {
      const j = manifest.photos.findIndex((p) => p.name === hash.get("view"));
      if (j >= 0) return jump(j, 0);
    }
    const pose = hash.has("pose") ? poseFrom(hash.get("pose")) : null;
    camera.setPose(pose ?? home);
    touch();
  };
  camera.setPose(home);
  fromHash();
  window.addEventListener("hashchange", fromHash);
  new ResizeObserver(() => {
    state.dirty = true;
  }).observe(canvas);
  photos.setOrder(orderFor(viewNow()));
  photos.pump();

  let last = performance.now(), firstPicture = null;
  const frame = () => {
    if (lost) return;
    const now = performance.now(), seconds = Math.min(0.1, (now - last) / 1000);
    last = now;
    if (moveByKeys(seconds) || camera.step(now / 1000)) touch();
    if (state.playing) {
      const share = ((now / 1000 - state.playing.begin) / manifest.path_seconds) % 1;
      camera.setPose(alongPath(manifest.path, share));
      touch();
    }
    if (manifest.time && state.timeRuns && manifest.settings.terms.time) {
      const length = manifest.time.end_s - manifest.time.begin_s;
      state.time_s = manifest.time.begin_s +
          ((((state.time_s ?? 0) + seconds - manifest.time.begin_s) % length) + length) % length;
      byId("time").value = String((state.time_s - manifest.time.begin_s) / length);
      state.dirty = true;
    }
    if (!state.sharp && now - state.moved > 200) {
      state.sharp = true;
      state.dirty = true;
    }
    if (state.dirty) draw(now);
    requestAnimationFrame(frame);
  };
  const draw = (now) => {
    const size = sizeNow();
    if (canvas.width !== size.canvas[0] || canvas.height !== size.canvas[1])
      [canvas.width, canvas.height] = size.canvas;
    const view = viewNow();
    state.dirty = false;
    photos.setOrder(orderFor(view));
    photos.pump();
    renderer.render(view, state.settings, state.show);
    renderer.present(...size.canvas, [0.086, 0.09, 0.098], state.show);
    const overlay = byId("overlay");
    if (state.overlay || overlay.width !== 1) {
      [overlay.width, overlay.height] = state.overlay ? size.canvas : [1, 1];
      if (state.overlay) drawCameras(overlay, manifest, view, 0.12 * manifest.typical_depth);
    }
    if (firstPicture === null && gl.getError() === gl.OUT_OF_MEMORY)
      say("The graphics processor has no memory left for this scene. Close other tabs and programs, and reload.");
    if (firstPicture === null && photos.hasNearest(state.settings.k)) {
      gl.finish();
      firstPicture = {ms: performance.now() - begun, bytes: bytesLoaded};
      photos.begin();
      showLoading();  // there may be no more to come
    }
    const ms = performance.now() - now;
    frames.push(ms);
    if (frames.length > 240) frames.shift();
    if (!state.sharp) movingScale = Math.min(1, Math.max(0.35, movingScale * (ms > 40 ? 0.9 : ms < 20 ? 1.05 : 1)));
  };
  showLoading();
  requestAnimationFrame(frame);

  // What tests and curious people ask for.
  window.lumigraph = {
    manifest,
    camera,
    state,
    actions,
    photos,
    renderer,
    // When the k nearest photos, small ones as they may be, were first drawn: ms since the page began, bytes loaded.
    get firstPicture() {
      return firstPicture;
    },
    get bytesLoaded() {
      return bytesLoaded;
    },
    // On the graphics processor: photos, what they see of the proxy, the proxy.
    get graphicsBytes() {
      return photos.bytes + besidePhotos;
    },
    memoryMb,
    frames,
    orderFor,
    home,
    poseText: () => poseText(camera.pose),
    // Of the fly-through, share 0 to 1.
    viewAlong(share, w, h) {
      const other = new PersonCamera(manifest);
      other.setPose(alongPath(manifest.path, share));
      return other.view(w, h);
    },
    // A picture of exactly this view, after the photos on their way have come: RGBA rows from the top.
    async picture(view, change = {}) {
      photos.setOrder(orderFor(view));
      photos.pump();
      while (!photos.finished) await new Promise((resolve) => setTimeout(resolve, 20));
      renderer.render(view, {...state.settings, ...change}, change.show ?? "color");
      return {size: view.size, pixels: renderer.readPicture()};
    },
    // The same as text, to take out of the page.
    async pictureText(view, change) {
      const {pixels} = await this.picture(view, change);
      let text = "";
      for (let i = 0; i < pixels.length; i += 8192) text += String.fromCharCode(...pixels.subarray(i, i + 8192));
      return btoa(text);
    },
    // Milliseconds a frame, read back so that it is drawn.
    time(view, repeats) {
      const times = [];
      for (let i = 0; i < repeats; ++i) {
        const t = performance.now();
        renderer.render(view, state.settings, "color");
        renderer.readPicture();
        times.push(performance.now() - t);
      }
      return times.sort((a, b) => a - b)[repeats >> 1];
    },
  };
};

// Effects by the names that --effects has.
const settingOf = (name) => ({fov: "field_of_view"}[name] ?? name);
const canSwitch = (settings, name) => settingOf(name) in settings || name in settings.terms;
const setEffect = (settings, manifest, name, on) => {
  const key = settingOf(name);
  if (key in settings) settings[key] = on;
  if (key in settings.terms) settings.terms[key] = on;
};

start().catch((error) => {
  say(error.message);
  console.error(error);
});
