const kTapMs = 250;

// Pointers, wheel and keys to movements of the camera. touched: called for each, so that the picture is drawn.
const attachControls = (canvas, camera, actions, touched) => {
  const pointers = new Map();
  let pinch = null;
  const side = () => Math.min(canvas.clientWidth, canvas.clientHeight) || 1;
  const two = () => {
    const [a, b] = [...pointers.values()];
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y))};
  };
  canvas.addEventListener("pointerdown", (e) => {
    canvas.focus({preventScroll: true});
    canvas.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, {x: e.clientX, y: e.clientY, button: e.button});
    pinch = pointers.size === 2 ? two() : null;
    actions.stop();
    e.preventDefault();
  });
  canvas.addEventListener("pointermove", (e) => {
    const last = pointers.get(e.pointerId);
    if (!last) return;
    const dx = (e.clientX - last.x) / side(), dy = (e.clientY - last.y) / side();
    last.x = e.clientX;
    last.y = e.clientY;
    if (pointers.size === 1) {
      if (last.button === 2 || last.button === 1 || e.shiftKey)
        camera.slide(dx, dy);
      else if (camera.mode === "orbit")
        camera.turn(dx * Math.PI, -dy * Math.PI);
      else
        camera.turn(-dx / camera.focal, dy / camera.focal);
    } else if (pointers.size === 2) {
      const now = two();
      if (pinch) {
        camera.slide((now.x - pinch.x) / side(), (now.y - pinch.y) / side());
        camera.approach(pinch.apart / now.apart);
      }
      pinch = now;
    }
    touched();
  });
  const up = (e) => {
    pointers.delete(e.pointerId);
    pinch = pointers.size === 2 ? two() : null;
  };
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, up);
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    const unit = e.deltaMode === 1 ? 30 : e.deltaMode === 2 ? 400 : 1;
    actions.stop();
    camera.approach(Math.exp(Math.max(-1, Math.min(1, (e.deltaY * unit) / 800))));
    touched();
    e.preventDefault();
  }, {passive: false});
  canvas.addEventListener("dblclick", (e) => actions.pivot(e.offsetX, e.offsetY));

  // Each key moves at once: a tap is a step. Held for longer than a tap, it moves on until it is let go.
  const held = new Map();  // and since when, ms
  const moves = {
    ArrowUp: [1, 0, 0],
    KeyW: [1, 0, 0],
    ArrowDown: [-1, 0, 0],
    KeyS: [-1, 0, 0],
    ArrowLeft: [0, -1, 0],
    KeyA: [0, -1, 0],
    ArrowRight: [0, 1, 0],
    KeyD: [0, 1, 0],
    KeyQ: [0, 0, 1],
    KeyE: [0, 0, -1]
  };
  const once = {
    Space: actions.play,
    Home: actions.home,
    KeyL: actions.link,
    KeyF: actions.full,
    KeyM: actions.panel,
    KeyC: actions.falseColor,
    KeyP: actions.proxy,
    KeyV: actions.cameras,
    KeyH: actions.help,
    Escape: actions.close,
    Comma: () => actions.photo(-1),
    Period: () => actions.photo(1)
  };
  // Wherever the focus is: a page that was just opened has it nowhere, and a click on a button takes it along. Sliders,
  // lists and fields keep their keys, buttons and boxes the space bar.
  const keeps = (e) => e.target instanceof Element && e.code !== "Escape" &&
    (e.target.matches("select, textarea, input:not([type=checkbox])") ||
     (e.code === "Space" && e.target.matches("button, a, summary, input")));
  window.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || keeps(e)) return;
    if (moves[e.code]) {
      if (!held.has(e.code)) {
        held.set(e.code, performance.now());
        actions.stop();
        camera.walk(...scaled(moves[e.code], 0.05));
      }
    } else if (once[e.code]) {
      if (!e.repeat) once[e.code]();
    } else
      return;
    touched();
    e.preventDefault();
  });
  window.addEventListener("keyup", (e) => held.delete(e.code));
  window.addEventListener("blur", () => held.clear());
  // seconds since the last frame; true: something moved.
  return (seconds) => {
    let moved = false;
    for (const [code, since] of held) {
      if (performance.now() - since < kTapMs) continue;
      camera.walk(...scaled(moves[code], seconds));
      moved = true;
    }
    return moved;
  };
};
