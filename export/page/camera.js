// The person's camera: a place, a rotation (cam_from_world), a focal length over the shorter side of a picture, and
// that picture's aspect: it fits into the window as a whole. In the scene's normalised frame; moved by drags, keys and
// wheel, about a pivot or freely.

class PersonCamera {
  constructor(manifest) {
    this.up = manifest.up;
    this.near = manifest.near;
    this.centre = [0, 0, 0];
    this.rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1];
    this.focal = 1;
    this.aspect = 1;
    this.pivotDistance = manifest.typical_depth;
    this.mode = "orbit";
    this.flight = null;
  }
  get forward() {
    return row(this.rotation, 2);
  }
  get pivot() {
    return add(this.centre, scaled(this.forward, this.pivotDistance));
  }
  get pose() {
    return {centre: this.centre, rotation: this.rotation, focal: this.focal, aspect: this.aspect};
  }
  setPose(pose) {
    this.centre = [...pose.centre];
    this.rotation = [...pose.rotation];
    this.focal = pose.focal ?? this.focal;
    this.aspect = pose.aspect ?? this.aspect;
  }
  // pixels from directions for a picture of w x h.
  view(w, h) {
    const a = this.aspect, f = this.focal * Math.min(a, 1) * Math.min(w / a, h),
          k = [f, 0, w / 2, 0, f, h / 2, 0, 0, 1];
    return {m: times(k, this.rotation), centre: this.centre, size: [w, h]};
  }
  // A photo's own pose; its picture's shorter side fits the window's.
  static poseOf(photo) {
    const rotation = PersonCamera.upright(rotationOf(photo.m), photo.turns);
    const [w, h] = photo.turns % 2 === 0 ? photo.size : [photo.size[1], photo.size[0]];
    return {centre: photo.centre, rotation, focal: photo.focal_px / Math.min(w, h), aspect: w / h};
  }
  // Photos keep their pixels as they are stored: who looks through one's camera sees it as EXIF says. turns: quarter
  // turns to the right that bring it upright.
  static upright(rotation, turns) {
    for (let i = 0; i < turns; ++i) {
      const x = row(rotation, 0), y = row(rotation, 1);
      rotation = [...scaled(y, -1), ...x, ...row(rotation, 2)];
    }
    return rotation;
  }

  // Radians to the right and down.
  turn(dx, dy) {
    const {up} = this, about = this.pivot;
    const angle = Math.acos(Math.min(1, Math.max(-1, dot(this.forward, up))));
    // Not over the poles: within a degree of them the horizon would spin.
    const least = Math.PI / 180, pitch = Math.min(Math.PI - least - angle, Math.max(least - angle, dy));
    const right = row(this.rotation, 0);
    const spin = (v) => turned(turned(v, right, -pitch), up, -dx);
    this.rotation = [...unit(spin(right)), ...unit(spin(row(this.rotation, 1))), ...unit(spin(this.forward))];
    if (this.mode === "orbit") this.centre = sub(about, scaled(this.forward, this.pivotDistance));
  }
  // In widths of the picture at the pivot.
  slide(dx, dy) {
    const step = this.pivotDistance / this.focal;
    this.centre =
        add(this.centre, add(scaled(row(this.rotation, 0), -dx * step), scaled(row(this.rotation, 1), -dy * step)));
  }
  // factor < 1: nearer.
  approach(factor) {
    const distance = Math.max(this.near, this.pivotDistance * factor);
    this.centre = add(this.centre, scaled(this.forward, this.pivotDistance - distance));
    this.pivotDistance = distance;
  }
  // Forward, right, down: steps of the typical depth.
  walk(forward, right, down) {
    const s = this.pivotDistance * 0.6;
    this.centre =
        add(this.centre,
            add(scaled(this.forward, forward * s),
                add(scaled(row(this.rotation, 0), right * s), scaled(row(this.rotation, 1), down * s))));
  }
  // Roll back to level, softly, so that a photo taken askew does not leave the person askew.
  level(share) {
    const wanted = lookingAlong(this.forward, this.up);
    this.rotation = slerpRotation(this.rotation, wanted, share);
  }
  flyTo(pose, seconds, now) {
    this.flight = seconds > 0 ? {from: this.pose, to: pose, begin: now, seconds} : null;
    if (seconds <= 0) this.setPose(pose);
  }
  // True while something moves.
  step(now) {
    if (!this.flight) return false;
    const {from, to, begin, seconds} = this.flight;
    const x = Math.min(1, (now - begin) / seconds), s = x * x * (3 - 2 * x);
    this.setPose({
      centre: add(scaled(from.centre, 1 - s), scaled(to.centre, s)),
      rotation: slerpRotation(from.rotation, to.rotation, s),
      focal: from.focal * Math.pow(to.focal / from.focal, s),
      aspect: from.aspect * Math.pow((to.aspect ?? from.aspect) / from.aspect, s),
    });
    if (x >= 1) this.flight = null;
    return true;
  }
}

// Places along a path of poses at even times, closed or not: a Catmull-Rom curve through the centres.
const alongPath = (path, share) => {
  const n = path.length;
  if (n === 1) return path[0];
  const at = Math.min(n - 1 - 1e-9, Math.max(0, share * (n - 1))), i = Math.floor(at), t = at - i;
  const p = [-1, 0, 1, 2].map((k) => path[Math.min(n - 1, Math.max(0, i + k))]);
  const curve = (a, b, c, d) =>
      0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t + (3 * b - a - 3 * c + d) * t * t * t);
  return {
    centre: [0, 1, 2].map((k) => curve(...p.map((q) => q.centre[k]))),
    rotation: slerpRotation(p[1].rotation, p[2].rotation, t),
    focal: p[1].focal * Math.pow(p[2].focal / p[1].focal, t),
    aspect: p[1].aspect,
  };
};

// A pose as text for a link, and back; null where it is none.
const poseText =
    (pose) => [...pose.centre, ...pose.rotation, pose.focal, pose.aspect].map((v) => +v.toPrecision(7)).join(",");
const poseFrom = (text) => {
  const v = text.split(",").map(Number);
  if (v.length !== 14 || v.some((x) => !Number.isFinite(x))) return null;
  const rotation = rotationOf(v.slice(3, 12));
  if (rotation.some((x) => !Number.isFinite(x)) || !(v[12] > 0.01 && v[12] < 1000 && v[13] > 0.01 && v[13] < 100))
    return null;
  return {centre: v.slice(0, 3), rotation, focal: v[12], aspect: v[13]};
};
