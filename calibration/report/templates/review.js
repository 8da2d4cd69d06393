// The review page: its data, its pictures, and what is chosen. The other files draw from them.
const DATA = JSON.parse(document.getElementById("data").textContent);
const EMBEDDED = JSON.parse(document.getElementById("embedded").textContent);
const MATERIALS = DATA.materials, LIGHTS = DATA.lights, PICTURED = LIGHTS.filter((light) => light.pictured);
const LIGHT = Object.fromEntries(LIGHTS.map((light) => [light.id, light]));
const FROM = LIGHTS.find((light) => light.id === DATA.from);
const chosen = {
  light: PICTURED[0].id, observer: DATA.observers[0], view: "p", marks: false, tab: "pictures", order: "attention",
  find: "", size: 300, standard: "",
};

const one = (selector) => document.querySelector(selector), all = (selector) => [...document.querySelectorAll(selector)];
const escaped = (text) => text.replace(/[&<>"]/g, (sign) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[sign]);
const signed = (text) => text.replace("-", "−");
const tenths = (value) => signed(value.toFixed(1));
const cents = (value) => (value > 0 && value < 0.005 ? "<0.01" : value.toFixed(2));
const percent = (share) => (share > 0 && share < 0.005 ? "<1 %" : `${Math.round(100 * share)} %`);
const icon = (name, words) =>
  `<svg class="i" ${words ? `role="img" aria-label="${escaped(words)}"` : 'aria-hidden="true"'}><use href="#${name}"/></svg>`;

// A figure beside a limit is never written on the limit's other side.
function beside(value, ...limits) {
  if (value > 0 && value < 0.005 && limits.every((limit) => limit >= 0.01)) return "<0.01";
  for (let digits = 2; digits < 9; digits += 1) {
    const text = value.toFixed(digits);
    if (limits.every((limit) => Number(text) > limit === value > limit)) return text;
  }
  return String(value);
}
const error = (value) => beside(value, DATA.limit, DATA.borderline);

// Pictures are files of the page itself, made when they are first asked for; where larger ones lie beside the page, those
// are shown.
function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at += 1) bytes[at] = text.charCodeAt(at);
  return bytes;
}
// Header and palette of a map, in bytes.
const HEAD = 813;
const KINDS = { p: "webp", r: "webp", d: "png", m: "png" };
class Pictures {
  constructor(row) {
    this.own = EMBEDDED[row.picture];
    this.made = {};
    this.beside = row.beside;
  }

  address(view) {
    if (!(view in this.own)) return "";
    let bytes = this.made[view] ? null : bytesOf(this.own[view]);
    // Pixels that a map does not compare are transparent.
    if (bytes && view === "d") bytes = new Blob([bytes.subarray(0, HEAD), bytesOf(DATA.codes.clear), bytes.subarray(HEAD)]);
    this.made[view] ||= URL.createObjectURL(new Blob([bytes], { type: `image/${KINDS[view]}` }));
    return this.made[view];
  }

  // The address to show: of the larger file where it can be read.
  async best(view) {
    const larger = this.beside[view];
    if (larger && (await ready(larger))) return larger;
    await ready(this.address(view));
    return this.address(view);
  }
}
for (const material of MATERIALS) {
  material.pictures = Object.fromEntries(Object.entries(material.rows).map(([light, row]) => [light, new Pictures(row)]));
}
const decoded = new Map();
function ready(url) {
  if (!url) return Promise.resolve(false);
  let image = decoded.get(url);
  if (!image) {
    image = new Image();
    image.src = url;
    decoded.set(url, image);
  }
  return image.decode().then(() => true, () => false);
}
// Markup names pictures and files as data, and gets them here: addresses come from scripts alone.
function filled(place, html) {
  place.innerHTML = html;
  place.querySelectorAll("[data-picture]").forEach((image) => { image.src = image.dataset.picture; });
  place.querySelectorAll("[data-to]").forEach((link) => { link.href = link.dataset.to; });
}

function say(text) { one(one("#detail").open ? "#d-live" : "#live").textContent = text; }

function check(name, value) { all(`input[name="${name}"]`).forEach((input) => { input.checked = input.value === value; }); }

const VIEW_WORDS = { p: "Showing the picture", r: "Showing the reference", d: "Showing the difference" };
const ON_CHANGE = {
  light(value) { check("light", value); paint(); redetail(); say(`Light: ${LIGHT[value].name}`); },
  view(value) { check("view", value); one("#mapkey").hidden = value !== "d"; paint(); say(VIEW_WORDS[value]); },
  observer(value) {
    check("observer", value);
    const note = one("#observer-note");
    note.hidden = value === DATA.observers[0];
    note.textContent = `Pictures are for the ${DATA.observers[0]} observer. Figures and colour shifts now are for ${value}.`;
    paint(); redetail();
    if (chosen.tab === "shift") shifts();
    say(`Observer: ${value}`);
  },
  marks(value) {
    one("#marks").setAttribute("aria-pressed", value);
    paint(); redetail();
    say(value ? "Marked: what this screen cannot show" : "Marks off");
  },
  size(value) {
    one("#size").value = value;
    document.documentElement.style.setProperty("--tile", `${value}px`);
    paint();
  },
  order() { arrange(); paint(); },
  find() { arrange(); paint(); if (chosen.tab === "shift") shifts(); },
  standard() { shifts(); },
  tab(value) {
    for (const tab of ["pictures", "shift"]) {
      one(`#v-${tab}`).hidden = tab !== value;
      one(`[data-tab=${tab}]`).setAttribute("aria-current", tab === value);
    }
    all(".only-pictures").forEach((part) => { part.hidden = value !== "pictures"; });
    if (value === "shift") shifts(); else paint();
  },
};
function set(name, value) { chosen[name] = value; ON_CHANGE[name](value); }
