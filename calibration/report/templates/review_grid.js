// The grid of pictures: order and places are fixed, and pictures are decoded before any of them is exchanged.
const first = (material) => (colourOf(material, DATA.from) || colourOf(material, PICTURED[0].id) || { lab: [0, 0, 0] }).lab;
const ORDERS = {
  attention: (material) => -trouble(material),
  error: (material) => -worstError(material),
  shift: (material) => { const worst = worstShift(material); return worst ? -worst[0].deltaE : 0; },
  hue: (material) => (chromaOf(first(material)) < 5 ? 400 + first(material)[0] : hueOf(first(material))),
  lightness: (material) => first(material)[0],
  name: (material) => material.name,
  reviewed: (material) => MATERIALS.indexOf(material),
};
function fits(material) {
  const status = Object.values(material.rows).map((row) => row.level).join(" ");
  const text = `${material.name} ${material.family} ${material.id} ${material.standing.badge} ${status}`;
  return hasWords(text, wordsOf(chosen.find));
}
const tiles = MATERIALS.map((material) => {
  const item = document.createElement("li");
  item.innerHTML = `<button class="tile" type="button" tabindex="-1"><span class="stage"><img alt="" decoding="sync" draggable="false"><span class="hatch" hidden></span></span>`
    + `<span class="cap"><b><span>${escaped(material.name)}</span>${icon(material.standing.icon, material.standing.badge)}</b><span class="line"></span><span class="say"></span></span></button>`;
  const part = (selector) => item.querySelector(selector);
  const tile = { material, item, button: item.firstChild, stage: part(".stage"), image: part("img"), hatch: part(".hatch"), line: part(".line"), say: part(".say") };
  tile.button.addEventListener("click", () => openDetail(material));
  return tile;
});
let shown = tiles;
function arrange() {
  const key = ORDERS[chosen.order];
  shown = tiles.filter((tile) => fits(tile.material)).map((tile, at) => [key(tile.material), at, tile])
    .sort((x, y) => (x[0] < y[0] ? -1 : x[0] > y[0] ? 1 : x[1] - y[1])).map((entry) => entry[2]);
  one("#grid").replaceChildren(...shown.map((tile) => tile.item));
  shown.forEach((tile, at) => { tile.button.tabIndex = at ? -1 : 0; });
  const total = `${MATERIALS.length} material${MATERIALS.length === 1 ? "" : "s"}`;
  one("#count").textContent = shown.length === MATERIALS.length ? total : `${shown.length} of ${total}`;
  one("#nothing").hidden = shown.length > 0;
}
function onScreen(tile) {
  const box = tile.item.getBoundingClientRect();
  return box.bottom > -300 && box.top < innerHeight + 300;
}
function mask(hatch, pictures) {
  const url = chosen.marks && pictures ? pictures.address("m") : "";
  hatch.hidden = !url;
  if (!hatch.hidden) hatch.style.webkitMaskImage = hatch.style.maskImage = `url(${url})`;
}

function caption(tile) {
  const material = tile.material, row = material.rows[chosen.light], limits = limitsOf(material, chosen.light);
  if (!row) {
    tile.line.textContent = `not drawn under ${LIGHT[chosen.light].name}`;
    tile.say.textContent = "";
    return;
  }
  const colour = lchWords(colourOf(material, chosen.light));
  tile.line.textContent = chosen.view === "d" ? `99 % within ΔE94 ${error(row.p99)}, mean ${cents(row.mean)}` : colour;
  const other = limits.length ? null : PICTURED.find((light) => limitsOf(material, light.id).length);
  if (limits.length) tile.say.innerHTML = `${icon("i-warn")}<span>${limits[0][0]}</span>`;
  else tile.say.innerHTML = other ? `<span class="light">Under ${escaped(other.id)}: ${limitsOf(material, other.id)[0][0].toLowerCase()}</span>` : "";
  tile.button.setAttribute("aria-label", `${material.name}, under ${LIGHT[chosen.light].name}. ${colour}. ${material.standing.badge}. `
    + `Rendering error: 99 % of the surface within ΔE94 ${error(row.p99)}, ${row.level}.${limits.map((limit) => ` Doubtful: ${limit[1]}`).join("")} Opens large.`);
}

let painting = 0;
async function paint() {
  painting += 1;
  const mine = painting, { view, light } = chosen;
  const near = chosen.tab === "pictures" ? new Set(shown.filter(onScreen)) : new Set();
  const urls = new Map();
  await Promise.all([...near].map(async (tile) => {
    const own = tile.material.pictures[light];
    urls.set(tile, own ? await own.best(view) : null);
  }));
  if (mine !== painting) return;
  // At once what is on the screen; the rest may wait until that is painted.
  for (const tile of near) put(tile, urls.get(tile), light);
  document.body.dataset.painted = light + view + chosen.observer + chosen.marks;
  // A picture of before is worse than none: what is not near the screen gets its own as it comes.
  setTimeout(() => {
    if (mine !== painting) return;
    for (const tile of tiles) if (!near.has(tile)) put(tile, "", light);
  }, 60);
}
function put(tile, url, light) {
  if (!url) tile.image.removeAttribute("src");
  else if (tile.image.src !== url) tile.image.src = url;
  tile.stage.classList.toggle("map", chosen.view === "d");
  mask(tile.hatch, tile.material.pictures[light]);
  caption(tile);
}
function focusTile(tile) {
  shown.forEach((each) => { each.button.tabIndex = each === tile ? 0 : -1; });
  tile.button.focus();
}
// Tiles that come near the screen, with their pictures under every light.
const coming = new IntersectionObserver((entries) => {
  for (const tile of entries.filter((entry) => entry.isIntersecting).map((entry) => tiles.find((each) => each.item === entry.target))) {
    const { view, light } = chosen, own = tile.material.pictures[light];
    if (own) own.best(view).then((url) => { if (view === chosen.view && light === chosen.light) put(tile, url, light); });
    for (const each of Object.values(tile.material.pictures)) each.best(view);
  }
}, { rootMargin: "600px" });
tiles.forEach((tile) => coming.observe(tile.item));
