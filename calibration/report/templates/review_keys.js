// Clicks and keys; then the page begins.
for (const name of ["light", "observer", "view"]) one(`#${name}`).addEventListener("change", (event) => set(name, event.target.value));
one("#d-light").addEventListener("change", (event) => set("light", event.target.value));
one("#d-mode").addEventListener("change", (event) => { mode = event.target.value; detail(); });
one("#marks").onclick = () => set("marks", !chosen.marks);
one("#size").oninput = (event) => set("size", Number(event.target.value));
one("#find").oninput = (event) => set("find", event.target.value);
one("#order").onchange = (event) => set("order", event.target.value);
one("#standard").onchange = (event) => set("standard", event.target.value);
all("[data-tab]").forEach((button) => { button.onclick = () => set("tab", button.dataset.tab); });
one("#print").onclick = () => { sheet(); print(); };
one("#more").onclick = () => one("#more").setAttribute("aria-expanded", document.body.classList.toggle("more"));
one("#d-close").onclick = () => dialog.close();
one("#d-prev").onclick = () => goBy(-1);
one("#d-next").onclick = () => goBy(1);
one("#d-strip").addEventListener("click", (event) => {
  const button = event.target.closest("[data-light]");
  if (!button) return;
  const light = button.dataset.light;
  set("light", light);
  all("#d-strip [data-light]").find((each) => each.dataset.light === light).focus();
});
document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-open]");
  if (button) openDetail(MATERIALS.find((material) => material.id === button.dataset.open));
});

const nextObserver = () => DATA.observers[(DATA.observers.indexOf(chosen.observer) + 1) % DATA.observers.length];
const KEYS = {
  p: () => set("view", "p"), r: () => set("view", "r"), d: () => set("view", "d"), m: () => set("marks", !chosen.marks),
  o: () => set("observer", nextObserver()),
  "+": () => set("size", Math.min(560, chosen.size + 40)), "=": () => KEYS["+"](), "-": () => set("size", Math.max(140, chosen.size - 40)),
  g: () => set("tab", "pictures"), s: () => set("tab", "shift"),
};
// Keys with another meaning, or none, while a material is opened.
const OPENED = { p: () => turn("p"), r: () => turn("r"), d: () => turn("d"), c: () => turn("c"), g: null, s: null, "/": null, "+": null, "=": null, "-": null };
function turn(to) { mode = to; detail(); }

function byArrow(event) {
  if (dialog.open) {
    if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
      event.preventDefault();
      goBy(event.key === "ArrowLeft" ? -1 : 1);
    }
    return;
  }
  const at = shown.findIndex((tile) => tile.button === document.activeElement);
  if (at < 0) return;
  const columns = getComputedStyle(one("#grid")).gridTemplateColumns.split(" ").length;
  const next = shown[at + { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns, ArrowDown: columns }[event.key]];
  event.preventDefault();
  if (!next) return;
  focusTile(next);
  next.item.scrollIntoView({ block: "nearest" });
}
document.addEventListener("keydown", (event) => {
  if (!event.key.startsWith("Arrow") || event.ctrlKey || event.metaKey || event.altKey || one("#help").open) return;
  const on = event.target.matches ? event.target : document.body;
  if (!on.matches("input, select, textarea, [role=region]")) byArrow(event);
});
singleKeys((key) => {
  const light = PICTURED[Number(key) - 1];
  if (light) return () => set("light", light.id);
  return dialog.open && key in OPENED ? OPENED[key] : KEYS[key];
});

// The target of a link is opened: its material, under its light.
function arrive() {
  const anchor = decodeURIComponent(location.hash.slice(1));
  for (const material of MATERIALS) {
    for (const [light, row] of Object.entries(material.rows)) if (row.anchor === anchor) return openDetail(material, light);
  }
}
addEventListener("hashchange", arrive);

one("#standard").insertAdjacentHTML("beforeend", MATERIALS.map((material) => `<option value="${escaped(material.id)}">${escaped(material.name)}</option>`).join(""));
arrange();
set("size", innerWidth < 700 ? 160 : 300);
arrive();
// Pictures of the other lights are decoded while the page is idle, so that a switch is immediate.
paint().then(() => {
  const waiting = [...shown];
  (function more() {
    const tile = waiting.shift();
    if (!tile) return;
    for (const own of Object.values(tile.material.pictures)) own.best("p");
    setTimeout(more, 8);
  })();
});
