// Maps of ΔE: the same codes on another scale, and the value under the pointer. `coded_map.py` says how they are stored.
const CODES = DATA.codes;
const codeValue = (code) => (code === 0 ? 0 : CODES.budget * 3 ** ((code - CODES.budgetCode) / CODES.stepsToThree));

// The codes of a map, row by row: it is unpacked here, since what a canvas gives back may be blurred on purpose.
async function unpacked(base64) {
  const data = bytesOf(base64), view = new DataView(data.buffer), parts = [];
  const width = view.getUint32(16), height = view.getUint32(20);
  for (let at = HEAD; at < data.length; at += 12 + view.getUint32(at)) {
    if (view.getUint32(at + 4) === 0x49444154) parts.push(data.subarray(at + 8, at + 8 + view.getUint32(at)));
  }
  const stream = new Blob(parts).stream().pipeThrough(new DecompressionStream("deflate"));
  const packed = new Uint8Array(await new Response(stream).arrayBuffer()), codes = new Uint8Array(width * height);
  for (let row = 0; row < height; row += 1) {
    const start = row * (width + 1), upwards = packed[start] === 2 && row > 0;
    for (let x = 0; x < width; x += 1) {
      codes[row * width + x] = packed[start + 1 + x] + (upwards ? codes[(row - 1) * width + x] : 0);
    }
  }
  return { width, height, codes };
}
function codeWords(code) {
  const upTo = codeValue(code).toPrecision(3);
  if (code === 255) return "Not compared here";
  if (code === 254) return "Here: no number";
  if (code > CODES.last) return `Here: ΔE94 above ${codeValue(CODES.last).toPrecision(3)}`;
  if (code < 2) return `Here: ΔE94 ${code ? `at most ${upTo}` : "0"}`;
  return `Here: ΔE94 ${codeValue(code - 1).toPrecision(3)} to ${upTo}`;
}
// The map as a canvas, from 0 to `top`; what is beyond is red, what holds no number magenta.
async function mapCanvas(row, top, told) {
  const map = await unpacked(EMBEDDED[row.picture].d), canvas = document.createElement("canvas"), steps = CODES.scale.length;
  [canvas.width, canvas.height] = [map.width, map.height];
  const brush = canvas.getContext("2d"), image = brush.createImageData(map.width, map.height);
  map.codes.forEach((code, at) => {
    if (code === 255) return;
    const value = codeValue(code), within = code <= CODES.last && value <= top;
    const colour = code === 254 ? CODES.undefined : within ? CODES.scale[Math.min(steps - 1, Math.floor(value / top * steps))] : CODES.over;
    image.data.set([...colour, 255], 4 * at);
  });
  brush.putImageData(image, 0, 0);
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `Difference map: 99 % of the surface within ΔE94 ${error(row.p99)}`);
  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect(), at = (place, low, size, count) => Math.min(count - 1, Math.max(0, Math.floor((place - low) / size * count)));
    const x = at(event.clientX, box.left, box.width, map.width), y = at(event.clientY, box.top, box.height, map.height);
    told(codeWords(map.codes[y * map.width + x]));
  });
  return canvas;
}
function scaleOf(top) {
  const ramp = CODES.scale.filter((_, at) => at % 3 === 0).map((colour) => `<i style="background:${rgb(colour)}"></i>`).join("");
  const parts = top === CODES.top ? [0, 1 / 3, 2 / 3, 1] : [0, 0.25, 0.5, 0.75, 1];
  const label = (value) => `${Number(value.toPrecision(2))}${Math.abs(value / CODES.budget - 1) < 1e-9 ? " limit" : ""}`;
  const ticks = parts.map((part) => `<span style="left:${100 * part}%">${label(part * top)}</span>`).join("");
  return `<div class="scale"><div class="ramp" role="img" aria-label="Scale of the difference map: ΔE94 from 0, dark, to ${Number(top.toPrecision(3))}, light; red is above">${ramp}<i class="over"></i></div><div class="ticks" aria-hidden="true">${ticks}</div></div>`;
}
