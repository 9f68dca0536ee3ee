// The panel, buttons and messages. Names are set as text, never as markup.
const byId = (id) => document.getElementById(id);

const say = (text) => {
  byId("message").textContent = text;
  byId("message").hidden = text === "";
};

const fillPanel = (manifest, state, actions) => {
  document.title = manifest.title;
  byId("title").textContent = manifest.title;
  for (const k of [1, 2, 3, 4, 6, 8, 12]) {
    const option = document.createElement("option");
    option.value = option.textContent = k;
    byId("k").append(option);
  }
  byId("k").value = String(state.settings.k);
  byId("k").addEventListener("change", () => actions.set({k: Number(byId("k").value)}));
  byId("show").addEventListener("change", () => actions.show(byId("show").value));
  byId("mode").addEventListener("change", () => actions.mode(byId("mode").value));
  byId("cameras").addEventListener("change", () => actions.overlay(byId("cameras").checked));
  for (const effect of manifest.effects) {
    const label = document.createElement("label"), box = document.createElement("input"),
          why = document.createElement("span");
    box.type = "checkbox";
    box.checked = effect.on;
    // What the photos were corrected for when the page was made stays so.
    box.disabled = !canSwitch(state.settings, effect.name);
    box.addEventListener("change", () => actions.effect(effect.name, box.checked));
    why.className = "evidence";
    why.textContent = effect.evidence;
    label.append(box, " " + effect.name, why);
    byId("effects").append(label);
  }
  manifest.photos.forEach((photo, j) => {
    const item = document.createElement("li"), button = document.createElement("button"),
          swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.style.background = "rgb(" + photo.color.map((c) => Math.round(255 * c)).join(",") + ")";
    button.append(swatch, photo.name);
    button.addEventListener("click", () => actions.jump(j));
    item.append(button);
    byId("photos").append(item);
  });
  const facts = [manifest.photos.length + " photos", manifest.proxy.faces + " faces", "proxy " + manifest.proxy.name];
  if (manifest.reduced) facts.push(manifest.reduced);
  byId("facts").textContent = facts.join("; ");
  if (manifest.time) {
    byId("time-section").hidden = false;
    byId("time").addEventListener("input", () => actions.time(Number(byId("time").value)));
    byId("time-runs").addEventListener("change", () => actions.timeRuns(byId("time-runs").checked));
  }
  for (const [id, action] of Object.entries(
           {play: actions.play, home: actions.home, link: actions.link, full: actions.full, more: actions.panel}))
    byId(id).addEventListener("click", action);
};

const markPhoto = (j) => {
  [...byId("photos").querySelectorAll("button")].forEach((button, i) => {
    if (i === j)
      button.setAttribute("aria-current", "true");
    else
      button.removeAttribute("aria-current");
  });
};

// The photos' cameras as small pyramids over the picture.
const drawCameras = (canvas, manifest, view, depthScale) => {
  const context = canvas.getContext("2d");
  context.clearRect(0, 0, canvas.width, canvas.height);
  const sx = canvas.width / view.size[0], sy = canvas.height / view.size[1];
  const onto = (x) => {
    const p = timesVector(view.m, sub(x, view.centre));
    return p[2] > 1e-6 ? [(p[0] / p[2]) * sx, (p[1] / p[2]) * sy] : null;
  };
  context.lineWidth = Math.max(1, canvas.width / 1200);
  for (const photo of manifest.photos) {
    const rays = inverse(photo.m), [w, h] = photo.size;
    const corners = [[0, 0], [w, 0], [w, h], [0, h]].map(
        (c) => onto(add(photo.centre, scaled(timesVector(rays, [...c, 1]), depthScale))));
    const apex = onto(photo.centre);
    if (!apex || corners.some((c) => !c)) continue;
    context.strokeStyle = "rgb(" + photo.color.map((c) => Math.round(255 * c)).join(",") + ")";
    context.beginPath();
    corners.forEach((c, i) => {
      context.moveTo(...apex);
      context.lineTo(...c);
      context.lineTo(...corners[(i + 1) % 4]);
    });
    context.stroke();
  }
};
