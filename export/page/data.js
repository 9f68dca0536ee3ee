// What the page was made with: the manifest, and binary parts beside it or inside the page.
const partText = (name) => document.getElementById("part-" + name);
const inPage = partText("manifest") !== null;

const bytesOf = (base64) => {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
};

// A part by its name; those inside the page are let go of once they are read.
const readPart = async (name) => {
  if (inPage) {
    const element = partText(name);
    if (element === null) throw new Error("this page lacks its part " + name);
    const bytes = bytesOf(element.textContent);
    element.remove();
    return bytes;
  }
  const answer = await fetch(name);
  if (!answer.ok) throw new Error("cannot load " + name + " (" + answer.status + ")");
  const bytes = new Uint8Array(await answer.arrayBuffer());
  bytesLoaded += bytes.length;
  return bytes;
};
let bytesLoaded = 0;

const readManifest = async () => {
  if (inPage) return JSON.parse(partText("manifest").textContent);
  if (location.protocol === "file:")
    throw new Error("browsers read no photos beside a page that was opened from disk: put this folder on a web server " +
      "(python3 -m http.server), or export one file (lumi-export web SCENE -o FILE.html)");
  const answer = await fetch("manifest.json");
  if (!answer.ok) throw new Error("cannot load manifest.json (" + answer.status + ")");
  const text = await answer.text();
  bytesLoaded += text.length;
  return JSON.parse(text);
};

// Corner after corner: x and the face's normal, six floats. Positions are whole steps from the least; edges first, so
// that coordinates of 16 or 24 bits cost no more than they need.
const readMesh = (bytes, about) => {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const vertex = new Float64Array(3 * about.vertices);
  let at = 0;
  for (let axis = 0; axis < 3; ++axis)
    for (let i = 0; i < about.vertices; ++i) {
      const q = about.bytes === 2 ? view.getUint16(at, true) : view.getUint16(at, true) + 65536 * view.getUint8(at + 2);
      at += about.bytes;
      vertex[3 * i + axis] = about.least[axis] + q * about.step[axis];
    }
  const wide = about.vertices > 65536;
  const corners = new Float32Array(18 * about.faces);
  for (let f = 0; f < about.faces; ++f) {
    const v = [0, 0, 0];
    for (let c = 0; c < 3; ++c) {
      v[c] = wide ? view.getUint32(at, true) : view.getUint16(at, true);
      at += wide ? 4 : 2;
    }
    const x = v.map((i) => [vertex[3 * i], vertex[3 * i + 1], vertex[3 * i + 2]]);
    const n = cross(sub(x[1], x[0]), sub(x[2], x[0])), length = norm(n);
    const normal = length > 0 ? scaled(n, 1 / length) : [0, 0, 0];
    for (let c = 0; c < 3; ++c) corners.set([...x[c], ...normal], 18 * f + 6 * c);
  }
  return corners;
};
