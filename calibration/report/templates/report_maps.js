// Maps of ΔE: the same codes on another scale, and the value under the pointer. `coded_map.py` says how they are stored.
(function () {
  "use strict";
  const codes = JSON.parse(document.getElementById("codes").textContent), maps = document.getElementById("maps");
  const START = "data:image/png;base64,", PALETTE = 41, PIXELS = 813;
  const images = Array.from(document.querySelectorAll("img.coded"), function (image) {
    const figure = image.closest("figure");
    return { image: image, own: image.src, top: figure.querySelector(".scale-top"), fitted: null, here: figure.querySelector(".here"), read: null };
  });

  function value(code) {
    return code === 0 ? 0 : codes.budget * Math.pow(3, (code - codes.budgetCode) / codes.stepsToThree);
  }

  function shortly(number) { return String(Number(number.toPrecision(3))); }

  function bytes(base64) { return Uint8Array.from(atob(base64), function (sign) { return sign.charCodeAt(0); }); }

  function checksum(data) {
    let sum = ~0;
    data.forEach(function (byte) {
      sum ^= byte;
      for (let bit = 0; bit < 8; bit += 1) sum = (sum >>> 1) ^ (sum & 1 ? 0xedb88320 : 0);
    });
    return ~sum >>> 0;
  }

  // The picture with a palette from 0 to `top`; what is beyond has the last colour, what has no value its own.
  function recoloured(source, top) {
    const end = START.length + 4 * PIXELS / 3, head = bytes(source.slice(START.length, end)), steps = codes.scale.length;
    for (let code = 0; code <= codes.last + 1; code += 1) {
      head.set(codes.scale[Math.min(steps - 1, Math.floor(value(code) / top * steps))], PALETTE + 3 * code);
    }
    new DataView(head.buffer).setUint32(PIXELS - 4, checksum(head.subarray(PALETTE - 4, PIXELS - 4)));
    return START + btoa(String.fromCharCode.apply(null, head)) + source.slice(end);
  }

  // Pixels not compared are transparent: the page's grey shows.
  const clear = bytes(codes.clear);
  function shownOf(source) {
    const data = bytes(source.slice(START.length));
    return URL.createObjectURL(new Blob([data.subarray(0, PIXELS), clear, data.subarray(PIXELS)], { type: "image/png" }));
  }

  function show(one) {
    const top = Number(one.image.dataset.p99), fitted = maps.value === "fitted" && top > 0;
    if (one.fitted === fitted) return;
    one.fitted = fitted;
    if (one.image.src.startsWith("blob:")) URL.revokeObjectURL(one.image.src);
    one.image.src = shownOf(fitted ? recoloured(one.own, top) : one.own);
    one.top.textContent = fitted ? shortly(top) : one.top.dataset.own;
  }

  // At once what is on the screen, the others when they come there, or onto paper: a page may have hundreds.
  const near = new Set();
  const watcher = new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      const one = images.find(function (each) { return each.image === entry.target; });
      if (entry.isIntersecting) near.add(one); else near.delete(one);
      if (entry.isIntersecting) show(one);
    });
  });
  images.forEach(function (one) { watcher.observe(one.image); });
  maps.addEventListener("input", function () { near.forEach(show); });
  window.addEventListener("beforeprint", function () { images.forEach(show); });

  // The codes of a picture, row by row: it is unpacked here, since what a canvas gives back may be blurred on purpose.
  async function unpacked(source) {
    const data = bytes(source.slice(START.length)), view = new DataView(data.buffer), parts = [];
    const width = view.getUint32(16), height = view.getUint32(20);
    for (let at = PIXELS; at < data.length; at += 12 + view.getUint32(at)) {
      if (view.getUint32(at + 4) === 0x49444154) parts.push(data.subarray(at + 8, at + 8 + view.getUint32(at)));
    }
    const stream = new Blob(parts).stream().pipeThrough(new DecompressionStream("deflate"));
    const packed = new Uint8Array(await new Response(stream).arrayBuffer()), found = new Uint8Array(width * height);
    for (let row = 0; row < height; row += 1) {
      const start = row * (width + 1), upwards = packed[start] === 2 && row > 0;
      for (let x = 0; x < width; x += 1) {
        found[row * width + x] = packed[start + 1 + x] + (upwards ? found[(row - 1) * width + x] : 0);
      }
    }
    return { width: width, height: height, codes: found };
  }

  function words(code) {
    const upTo = value(code).toPrecision(3);
    if (code === 255) return "not compared";
    if (code === 254) return "no number";
    if (code > codes.last) return "over " + value(codes.last).toPrecision(3);
    if (code < 2) return code ? "at most " + upTo : "0";
    return value(code - 1).toPrecision(3) + " to " + upTo;
  }

  // The `full` pixels that one of the map's touches.
  function span(at, shown, full) {
    const first = Math.floor(at * full / shown), last = Math.ceil((at + 1) * full / shown) - 1;
    return last > first ? first + "–" + last : String(first);
  }

  if (typeof DecompressionStream === "undefined") {
    return;
  }
  images.forEach(function (one) {
    let last = null;
    async function tell(event) {
      last = event;
      one.read = one.read || unpacked(one.own);
      const map = await one.read;
      if (last !== event) return;
      const box = one.image.getBoundingClientRect(), full = one.image.dataset.full.split(" ").map(Number);
      const x = Math.floor((event.clientX - box.left) / box.width * map.width);
      const y = Math.floor((event.clientY - box.top) / box.height * map.height);
      if (x < 0 || y < 0 || x >= map.width || y >= map.height) return;
      const kind = full[0] > map.height || full[1] > map.width ? " · largest of " : " · pixel ";
      const where = kind + span(x, map.width, full[1]) + ", " + span(y, map.height, full[0]);
      one.here.textContent = words(map.codes[y * map.width + x]) + where;
    }
    one.image.addEventListener("pointermove", tell);
    one.image.addEventListener("pointerdown", tell);
    one.image.addEventListener("pointerleave", function () {
      last = null;
      one.here.textContent = "";
    });
  });
})();
