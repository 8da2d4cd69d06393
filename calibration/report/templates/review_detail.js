// One material, opened: large, with a divider, the four answers, its colour under each light, its curve, its source.
const dialog = one("#detail");
let opened = null, mode = "c", magnified = false, drawing = 0;

function openDetail(material, light) {
  opened = material;
  mode = chosen.view === "d" ? "d" : "c";
  if (light && light !== chosen.light) set("light", light);
  detail();
  if (!dialog.open) dialog.showModal();
  one("#d-name").focus();
  dialog.scrollTop = 0;
}
function redetail() { if (dialog.open && opened) detail(); }
function goBy(by) {
  const at = shown.findIndex((tile) => tile.material === opened), next = (at + by + shown.length) % shown.length;
  if (!shown.length) return;
  opened = shown[next].material;
  detail();
  say(`${opened.name}, ${next + 1} of ${shown.length}`);
}
dialog.addEventListener("close", () => {
  const tile = shown.find((each) => each.material === opened);
  if (tile && chosen.tab === "pictures") focusTile(tile);
});

const MODE_WORDS = {
  c: "Left of the line the picture, right of it the reference. Drag, or use ← and →.",
  p: "What the renderer shows.",
  r: "What the material's data say, worked out slowly at every wavelength.",
};
async function stage(row, pictures) {
  drawing += 1;
  const mine = drawing, place = one("#d-stage"), name = escaped(opened.name), under = escaped(LIGHT[chosen.light].name);
  if (mode === "d") {
    const top = magnified ? Math.max(row.p99, CODES.budget / 100) : CODES.top;
    one("#d-under").innerHTML = `${scaleOf(top)}<p class="small row"><label><input type="checkbox" id="magnify"${magnified ? " checked" : ""}> Magnify: scale up to this picture's own 99 %</label><span id="read">Point at the map to read it</span></p>`;
    one("#magnify").onchange = (event) => { magnified = event.target.checked; detail(); one("#magnify").focus(); };
    const canvas = await mapCanvas(row, top, (words) => { if (one("#read")) one("#read").textContent = words; });
    if (mine !== drawing) return;
    place.className = "stage map";
    place.replaceChildren(canvas);
    return;
  }
  one("#d-under").innerHTML = `<p class="small row">${MODE_WORDS[mode]}</p>`;
  const [picture, reference] = await Promise.all([pictures.best("p"), pictures.best("r")]);
  if (mine !== drawing) return;
  const alt = (what) => `${what} of ${name} under ${under}`, hatch = '<span class="hatch" hidden></span>';
  place.className = mode === "c" ? "stage compare" : "stage";
  filled(place, mode === "c"
    ? `<img data-picture="${reference}" alt="${alt("Reference")}"><img class="top" data-picture="${picture}" alt="${alt("Picture")}">${hatch}<span class="line"></span><span class="tag left">Picture</span><span class="tag right">Reference</span><input type="range" min="0" max="100" value="50" aria-label="Divider: left of it the picture, right of it the reference">`
    : `<img data-picture="${mode === "p" ? picture : reference}" alt="${alt(mode === "p" ? "Picture" : "Reference")}">${hatch}`);
  mask(place.querySelector(".hatch"), pictures);
  const divider = place.querySelector("input");
  if (divider) divider.oninput = () => place.style.setProperty("--x", `${divider.value}%`);
  place.style.setProperty("--x", "50%");
}

function detail() {
  const material = opened, light = chosen.light, row = material.rows[light], pictures = material.pictures[light];
  one("#d-name").textContent = material.name;
  one("#d-pos").textContent = `${shown.findIndex((tile) => tile.material === material) + 1} of ${shown.length}`;
  check("d-light", light);
  check("d-mode", mode);
  if (row) stage(row, pictures);
  else one("#d-stage").textContent = `Not drawn under ${LIGHT[light].name}`;
  filled(one("#d-strip"), PICTURED.map((each) => {
    const own = material.pictures[each.id], shift = shiftOf(material, each.id);
    const moves = each.id === DATA.from ? "starting point" : shift ? `moves ${shift.deltaE.toFixed(1)}: ${shift.words}` : "";
    return `<button type="button" data-light="${escaped(each.id)}" aria-pressed="${each.id === light}"><span class="stage">${own ? `<img data-picture="${own.address("p")}" alt="">` : ""}</span><span class="n">${escaped(each.name)}</span><br><span class="tiny">${moves}</span></button>`;
  }).join(""));
  filled(one("#d-right"), standingPart(material) + (row ? trustPart(material, row, light) : "") + colourPart(material, light) + curvePart(material, light) + (row ? morePart(row) : ""));
}

const standingPart = (material) => `<p class="badges"><span class="badge${["uplifted", "reconstructed", "unknown"].includes(material.standing.colour) ? " guess" : ""}">${icon(material.standing.icon)} ${material.standing.badge}</span> <span class="small soft">${escaped(material.family)}</span></p>`;

function trustPart(material, row, light) {
  const item = (name, title, text) => `<li>${icon(name)}<div><b>${title}</b><span>${escaped(text)}</span></div></li>`;
  const limits = limitsOf(material, light).filter(([title]) => !/^(Rendering|Pixels|Colour guessed)/.test(title));
  const holes = row.undefined ? ` ${row.undefined} pixels hold no number.` : "";
  const items = [
    item(ICONS[row.status], `Rendering error: ${row.level}`, `99 % of the surface is within ΔE94 ${error(row.p99)} of the reference (limit ${DATA.limit}). On average ${cents(row.mean)}, at the worst point ${cents(row.max)}.${holes}`),
    ...limits.map(([title, text]) => item("i-warn", title, text)),
  ];
  if (!limits.length) items.push(item("i-ok", "This screen can show all of it", `Next to no part is too strong or too bright for ${DATA.screen}.`));
  items.push(item(material.standing.colour === "measured" ? "i-ok" : "i-near", material.standing.title, material.standing.plain));
  items.push(row.noise
    ? item(row.noise.limited ? "i-near" : "i-ok", `Reference: settled to ΔE94 ${cents(row.noise.mean)} on average`, "The reference itself is drawn by chance; this much of the error above may be its own.")
    : item("i-ok", "Reference: exact", "Nothing in it is left to chance."));
  if (chosen.observer !== DATA.observers[0]) items.push(item("i-near", `Picture is for the ${DATA.observers[0]} observer`, `Colours and shifts here are for ${chosen.observer}.`));
  return `<section aria-labelledby="h-trust"><h3 id="h-trust">Can I judge by this picture?</h3><ul class="trust">${items.join("")}</ul></section>`;
}

function colourPart(material, light) {
  const rows = LIGHTS.map((each) => [each, colourOf(material, each.id)]).filter(([, colour]) => colour);
  const cell = (text) => `<td class="num">${text}</td>`;
  const lines = rows.map(([each, colour]) => {
    const [l, a, b] = colour.lab, chroma = chromaOf(colour.lab);
    const moves = each.id === DATA.from || !colour.shift ? "–" : colour.shift.deltaE.toFixed(1);
    return `<tr${each.id === light ? ' aria-current="true"' : ""}><th scope="row"><span class="chip" style="background:${rgb(colour.swatch)}"></span>${escaped(each.name)}</th>${[tenths(l), tenths(a), tenths(b), chroma.toFixed(1), chroma < 1 ? "–" : hueOf(colour.lab).toFixed(0), moves].map(cell).join("")}</tr>`;
  }).join("");
  const around = (material.rows[light] || { around: [] }).around;
  const metal = around.length ? `<p class="small soft">L* by angle from the mirror direction: ${around.map(([angle, l]) => `${angle}°: ${tenths(l)}`).join(", ")} (above 100: brighter than white paper).</p>` : "";
  const moves = DATA.shifted ? `<p class="tiny soft">Moves: ΔE2000 from daylight, once the eye has adapted.</p>` : "";
  return `<section aria-labelledby="h-colour"><h3 id="h-colour">Colour under each light, ${chosen.observer} observer</h3><div class="scroll" tabindex="0" role="region" aria-label="Colour under each light"><table><thead><tr><th scope="col">Light</th>${["L*", "a*", "b*", "C*", "h°", "Moves"].map((name) => `<th scope="col" class="num">${name}</th>`).join("")}</tr></thead><tbody>${lines}</tbody></table></div>${moves}${metal}</section>`;
}

// The curve over the lamp: nm across, dashed where nothing was measured.
function curvePart(material, light) {
  const curve = material.spectrum;
  if (!curve) return "";
  const [width, height, left, right, top, bottom] = [460, 210, 34, 454, 10, 170], [low, high] = [380, 780];
  const highest = Math.max(...curve.values), ceiling = [0.1, 0.3, 0.6, 1].find((step) => highest <= step) || Math.ceil(highest * 2) / 2;
  const x = (nm) => left + (right - left) * (nm - low) / (high - low), y = (value) => bottom - (bottom - top) * Math.max(0, value) / ceiling;
  const line = (from, to) => curve.nm.map((nm, at) => [nm, curve.values[at]]).filter(([nm]) => nm >= Math.max(from, low) && nm <= Math.min(to, high))
    .map(([nm, value], at) => `${at ? "L" : "M"}${x(nm).toFixed(1)} ${y(value).toFixed(1)}`).join("");
  const lamp = LIGHT[light].spd;
  const spd = lamp ? `<path class="spd" d="M${left} ${bottom}${lamp.map((value, at) => `L${x(low + 5 * at).toFixed(1)} ${(bottom - (bottom - top) * value).toFixed(1)}`).join("")}L${right} ${bottom}Z"/>` : "";
  const grid = [0, 0.25, 0.5, 0.75, 1].map((part) => `<line class="g" x1="${left}" x2="${right}" y1="${y(part * ceiling)}" y2="${y(part * ceiling)}"/><text x="${left - 5}" y="${y(part * ceiling) + 4}" text-anchor="end">${Number((100 * part * ceiling).toFixed(1))}${part === 1 ? " %" : ""}</text>`).join("");
  const ticks = [400, 500, 600, 700].map((nm) => `<text x="${x(nm)}" y="${bottom + 15}" text-anchor="middle">${nm}${nm === 700 ? " nm" : ""}</text>`).join("");
  const names = [["violet", 412], ["blue", 460], ["green", 530], ["yellow", 585], ["red", 680]].map(([word, nm]) => `<text x="${x(nm)}" y="${bottom + 31}" text-anchor="middle">${word}</text>`).join("");
  const [from, to] = curve.measured || [low, high];
  const held = [[low, from], [to, high]].filter(([a, b]) => a < b).map(([a, b]) => `<path class="curve dash" d="${line(a, b)}"/>`).join("");
  const range = curve.measured ? `measured from ${curve.measured[0]} to ${curve.measured[1]} nm${held ? ", dashed: end value held" : ""}` : "the record does not say where it was measured";
  const lit = lamp ? ` Grey shape: the light, ${escaped(LIGHT[light].name)}. The colour changes where the two meet differently.` : "";
  return `<section aria-labelledby="h-curve"><h3 id="h-curve">Spectrum</h3><svg class="plot" viewBox="0 0 ${width} ${height}" role="img" aria-label="Spectrum of ${escaped(material.name)}: lowest ${(100 * Math.min(...curve.values)).toFixed(0)} %, highest ${(100 * highest).toFixed(0)} %">${spd}${grid}${ticks}${names}<path class="curve" d="${line(from, to)}"/>${held}</svg><p class="small soft">Line: how much of each wavelength the surface sends back, as ${escaped(curve.quantity)} (${range}).${lit}</p></section>`;
}

function morePart(row) {
  const material = opened;
  const bars = row.histogram, most = Math.sqrt(Math.max(1, ...bars)), wide = 168 / Math.max(1, bars.length);
  const shape = bars.map((count, at) => `<rect class="bars" x="${(at * wide).toFixed(1)}" width="${wide.toFixed(1)}" y="${(36 - 36 * Math.sqrt(count) / most).toFixed(1)}" height="${(36 * Math.sqrt(count) / most).toFixed(1)}"/>`).join("");
  const limitAt = (DATA.stepsBelow * wide).toFixed(1), over = bars.slice(DATA.stepsBelow).reduce((sum, count) => sum + count, 0);
  const spread = bars.length ? `<div><p>Pixels by their ΔE94, bars by the root of their number; line: the limit. ${over} of ${row.pixels} lie above it.</p><svg class="mini" viewBox="0 -4 168 44" role="img" aria-label="${over} of ${row.pixels} pixels above the limit">${shape}<path class="line" d="M${limitAt} -4V36"/></svg></div>` : "";
  const worst = row.worst ? `<div><p>Worst pixel, column and row ${row.worst.place}: ΔE94 ${error(row.worst.deltaE)}, ${row.worst.words} (picture less reference).</p>${pairPlot(row.worst)}</div>` : "";
  const earlier = row.earlier.length ? `<p>ΔE94 that 99 % stay under, in earlier runs: ${row.earlier.map(error).join(", ")}</p>` : "";
  const notes = row.notes.length ? `<ul>${row.notes.map((note) => `<li>${escaped(note)}</li>`).join("")}</ul>` : "";
  const files = Object.entries(row.files).map(([label, path]) => `<a data-to="${escaped(path)}">${escaped(label)}</a>`).join(" · ");
  const seconds = Object.entries(row.seconds).map(([name, value]) => `${name.replace("_", " ")} ${value < 1 ? `${Math.round(1000 * value)} ms` : `${value.toFixed(1)} s`}`).join(", ");
  const window_ = row.window ? `<p>In the review window, from the folder of this page: <code>${escaped(row.window)}</code></p>` : "";
  const facts = Object.entries(row.provenance).map(([label, text]) => `<p>${escaped(label)}: ${escaped(text)}</p>`).join("");
  return `<details class="plain"><summary>Source, files and figures</summary><div class="facts-more"><p>${escaped(material.source)}</p><p class="soft">${escaped(material.licence)}</p><p>Id: ${escaped(material.id)}. <a data-to="#${escaped(row.anchor)}">Link to this picture</a></p><p>${files}</p>${window_}${spread}${worst}${earlier}${notes}<p class="soft">${row.pixels} pixels compared, 95 % within ΔE94 ${error(row.p95)}${seconds ? `; ${seconds}` : ""}</p>${facts}</div></details>`;
}
function pairPlot(worst) {
  if (!worst.nm) return "";
  const top = Math.max(...worst.reference, ...worst.picture, 1e-6), last = worst.nm.length - 1;
  const path = (values) => values.map((value, at) => `${at ? "L" : "M"}${(168 * at / last).toFixed(1)} ${(62 - 62 * Math.max(0, value) / top).toFixed(1)}`).join("");
  return `<svg class="mini" viewBox="0 -4 168 80" role="img" aria-label="Radiance factor of the worst pixel: reference, and picture dashed, up to ${top.toPrecision(2)}"><path class="grid" d="M0 62H168"/><path class="line" d="${path(worst.reference)}"/><path class="line dash" d="${path(worst.picture)}"/><text x="0" y="73">${worst.nm[0]}</text><text x="168" y="73" text-anchor="end">${worst.nm[last]} nm; dashed: picture</text></svg>`;
}
