// Materials of a catalogue: all are searched and put in order, and those near the screen are elements.
//
// Rows of tiles are as high as what stands in them. Heights of rows that were never on the screen are taken to be the
// mean of the others; where that was wrong, what is looked at stays where it is.
const DATA = JSON.parse(document.getElementById("data").textContent);
const SHEETS = JSON.parse(document.getElementById("sheets").textContent);
const grid = document.getElementById("grid"), find = document.getElementById("find"), sort = document.getElementById("sort");
const choices = Array.from(document.querySelectorAll("select.choice"));
// Beyond the screen's edges, in pixels; the bar above, which covers what is scrolled beneath it.
const NEAR = 900, BAR = 76;
const CARDS = DATA.cards.map((row, number) => {
  const [id, title, family, quantity, colour, caption, words, attention, p99, lab, facts, anchor] = row;
  const text = (index) => DATA.texts[index];
  const pairs = [];
  for (let at = 0; at < facts.length; at += 2) pairs.push([text(facts[at]), text(facts[at + 1])]);
  const chroma = lab ? Math.hypot(lab[1], lab[2]) : -1;
  const hue = lab ? ((Math.atan2(lab[2], lab[1]) * 180) / Math.PI + 360) % 360 : -1;
  return { number, id, anchor: anchor || id, title, family: text(family), quantity: text(quantity), colour: text(colour), caption: text(caption),
    words: text(words), attention, p99: p99 === null ? -1 : p99, lab, lightness: lab ? lab[0] : -1, chroma, hue, facts: pairs, open: false, found: null };
});
const BY_ANCHOR = new Map(CARDS.map((card) => [card.anchor, card]));

// The words that a search looks for, made when somebody first searches.
function searched(card) {
  if (card.found === null) {
    const said = [card.id, card.title, DATA.badges[card.colour], card.family, card.quantity, ...card.facts.map((fact) => fact[1]), card.words && "cannot be used"];
    card.found = ` ${wordsOf(said.join(" ")).join(" ")}`;
  }
  return card.found;
}
let colour = "", order = CARDS, now = null;
const byName = new Intl.Collator(undefined, { numeric: true }).compare;
const RISING = ["hue", "lightness"];
function inOrder(cards) {
  const key = sort.value, rising = RISING.includes(key);
  if (key === "name") return cards.sort((a, b) => byName(a.id, b.id) || a.number - b.number);
  // Cards without a figure come last in both orders.
  return cards.sort((a, b) => (a[key] < 0) - (b[key] < 0) || (rising ? a[key] - b[key] : b[key] - a[key]) || a.number - b.number);
}
function update() {
  const words = wordsOf(find.value);
  order = inOrder(CARDS.filter((card) => (!colour || (!card.words && card.colour === colour))
    && choices.every((choice) => !choice.value || card[choice.name] === choice.value)
    && words.every((word) => searched(card).includes(` ${word}`))));
  const total = `${CARDS.length} ${CARDS.length === 1 ? "material" : "materials"}`, says = `${order.length} of ${total}`;
  document.getElementById("shown").textContent = order.length === CARDS.length ? total : order.length ? says : "No matches.";
  document.getElementById("left-out").textContent = order.length < CARDS.length ? `Only a part is shown: ${says}.` : "";
  document.querySelectorAll("[data-choose]").forEach((button) => { button.setAttribute("aria-pressed", button.dataset.choose === colour); });
  places = new Map(order.map((card, at) => [card, at]));
  if (!places.has(now)) settle(order[0] || null);
  heights = [];
  // The beginning of a new order is what is to be seen of it.
  if (grid.getBoundingClientRect().top < 0) scrollTo({ top: scrollY + grid.getBoundingClientRect().top - BAR, behavior: "instant" });
  draw();
}

// ---- elements of the cards near the screen ----
const live = new Map();
let places = new Map(), heights = [], tops = [0], columns = 1, width = 0, printing = false;
const addresses = [];
function sheet(number) {
  if (!addresses[number]) {
    const own = SHEETS[number];
    // One address for all of its pictures, which are then decoded once.
    addresses[number] = own.startsWith("data:") ? URL.createObjectURL(blobOf(own)) : own;
  }
  return addresses[number];
}
function blobOf(address) {
  const text = atob(address.slice(address.indexOf(",") + 1)), bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at += 1) bytes[at] = text.charCodeAt(at);
  return new Blob([bytes], { type: "image/webp" });
}
function picture(image, card) {
  const each = DATA.side * DATA.side, at = card.number % each, number = (card.number - at) / each;
  const across = Math.min(DATA.side, CARDS.length - number * each), cell = (DATA.pixels + 2) / DATA.pixels;
  image.alt = card.title;
  image.onerror = () => { document.getElementById("no-pictures").hidden = false; };
  image.style.width = `${100 * across * cell}%`;
  image.style.left = `${-100 * ((at % across) * cell + 1 / DATA.pixels)}%`;
  image.style.top = `${-100 * (Math.floor(at / across) * cell + 1 / DATA.pixels)}%`;
  image.src = sheet(number);
}
function element(card) {
  const item = document.getElementById("thumbnail").content.firstChild.cloneNode(true), part = (selector) => item.querySelector(selector);
  item.id = card.anchor;
  item.dataset.name = card.id;
  picture(part("img"), card);
  part("a").href = `#${encodeURIComponent(card.anchor).replaceAll("%2F", "/")}`;
  part("a").textContent = card.title;
  part(".family").textContent = card.family;
  if (card.lab) part(".lch").textContent = `L* ${card.lab[0].toFixed(1)} C* ${card.chroma.toFixed(1)} h ${card.hue.toFixed(0)}°`;
  else part(".lch").remove();
  part(".standing").replaceWith(document.getElementById(card.words ? "unusable" : `badge-${card.colour}`).content.cloneNode(true));
  part(".more").setAttribute("aria-label", `more of ${card.title}`);
  if (card.open) tell(item, card);
  return item;
}
function tell(item, card) {
  item.querySelector(".more").setAttribute("aria-expanded", card.open);
  const told = item.querySelector(".told");
  if (told) told.remove();
  if (!card.open) return;
  const box = document.createElement("div"), list = document.createElement("dl");
  box.className = "told";
  if (card.words) box.appendChild(document.createElement("p")).textContent = card.words;
  for (const [label, text] of [["id", card.id], ...(card.words ? [] : [["fast form", card.caption]]), ...card.facts]) {
    list.appendChild(document.createElement("dt")).textContent = label;
    list.appendChild(document.createElement("dd")).textContent = text;
  }
  box.append(list);
  item.querySelector(".cap").append(box);
}

function measureColumns() {
  const style = getComputedStyle(grid), gap = parseFloat(style.columnGap), tile = parseFloat(style.getPropertyValue("--column")) || 1;
  const inner = grid.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
  const count = Math.max(1, Math.floor((inner + gap) / (tile + gap)));
  const each = (inner - (count - 1) * gap) / count;
  if (count !== columns || each !== width) heights = [];
  [columns, width] = [count, each];
  return { gap, left: parseFloat(style.paddingLeft), above: parseFloat(style.paddingTop), below: parseFloat(style.paddingBottom), rowGap: parseFloat(style.rowGap) };
}
function measureRows(box) {
  const rows = Math.ceil(order.length / columns), known = heights.filter(Boolean);
  const mean = known.length ? known.reduce((sum, one) => sum + one, 0) / known.length : width + 120;
  tops = [box.above];
  for (let row = 0; row < rows; row += 1) tops.push(tops[row] + (heights[row] || mean) + box.rowGap);
  grid.style.height = `${rows ? tops[rows] - box.rowGap + box.below : 0}px`;
}
// The row at a height: the last whose top is not below it.
function rowAt(height) {
  let low = 0, high = tops.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (tops[middle] <= height) low = middle;
    else high = middle - 1;
  }
  return low;
}
function draw() {
  if (printing) return;
  const box = measureColumns();
  // The heights of the rows may bring others near; a few rounds settle it.
  for (let round = 0; round < 4; round += 1) {
    measureRows(box);
    const from = -grid.getBoundingClientRect().top, rows = tops.length - 1;
    const seen = rowAt(Math.max(0, from + BAR)), [first, last] = [rowAt(Math.max(0, from - NEAR)), rowAt(from + innerHeight + NEAR)];
    const wanted = order.slice(first * columns, Math.min(last + 1, rows) * columns);
    // The card with the focus keeps it, wherever it is.
    const held = document.activeElement.closest(".thumbnail"), holding = held && BY_ANCHOR.get(held.id);
    if (holding && places.has(holding) && !wanted.includes(holding)) wanted[places.get(holding) < first * columns ? "unshift" : "push"](holding);
    put(wanted);
    for (const [card, item] of live) {
      const at = places.get(card), row = Math.floor(at / columns);
      item.style.width = `${width}px`;
      item.style.left = `${box.left + (at - row * columns) * (width + box.gap)}px`;
      item.style.top = `${tops[row]}px`;
    }
    const found = new Map();
    for (const [card, item] of live) {
      const row = Math.floor(places.get(card) / columns);
      found.set(row, Math.max(found.get(row) || 0, item.offsetHeight));
    }
    const other = [...found].filter(([row, height]) => heights[row] !== height && (row !== Math.floor(places.get(holding) / columns) || (row >= first && row <= last)));
    if (!other.length) return;
    const before = tops[seen];
    for (const [row, height] of other) heights[row] = height;
    measureRows(box);
    if (from > 0 && Math.abs(tops[seen] - before) >= 1) scrollBy({ top: tops[seen] - before, behavior: "instant" });
  }
}
// Make the grid hold these cards, in this order; what stands in its place is left alone.
function put(wanted) {
  const kept = new Set(wanted);
  for (const [card, item] of live) {
    if (kept.has(card)) continue;
    item.remove();
    live.delete(card);
  }
  let next = grid.firstChild;
  for (const card of wanted) {
    let item = live.get(card);
    if (!item) {
      item = element(card);
      live.set(card, item);
    }
    item.setAttribute("aria-setsize", order.length);
    item.setAttribute("aria-posinset", places.get(card) + 1);
    if (item === next) next = next.nextSibling;
    else grid.insertBefore(item, next);
    item.querySelectorAll("a, button").forEach((one) => { one.tabIndex = card === now ? 0 : -1; });
  }
}

// ---- one tab stop for all names, which arrow keys move; links to each material ----
function settle(card) {
  for (const each of [now, card]) {
    if (each && live.has(each)) live.get(each).querySelectorAll("a, button").forEach((one) => { one.tabIndex = each === card ? 0 : -1; });
  }
  now = card;
}
// Bring a card onto the screen, at its top where it is to land there. Rows on the way there have their height only now.
function reach(card, land) {
  for (let round = 0; round < 6; round += 1) {
    const row = Math.floor(places.get(card) / columns), above = grid.getBoundingClientRect().top + tops[row];
    const below = above + (heights[row] || width) - innerHeight;
    const by = land || above < BAR ? above - BAR : below > 0 ? Math.min(below + 16, above - BAR) : 0;
    const before = scrollY;
    if (Math.abs(by) >= 1) scrollBy({ top: by, behavior: "instant" });
    draw();
    if (live.has(card) && heights[row] && scrollY === before) return;
  }
}
function to(card) {
  settle(card);
  reach(card, false);
  live.get(card).querySelector(".name a").focus({ preventScroll: true });
}
grid.addEventListener("keydown", (event) => {
  if (!event.target.matches(".name a")) return;
  const at = places.get(now), step = { ArrowLeft: at - 1, ArrowUp: at - 1, ArrowRight: at + 1, ArrowDown: at + 1, Home: 0, End: order.length - 1 }[event.key];
  if (step === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  if (order[step]) to(order[step]);
});
grid.addEventListener("focusin", (event) => settle(BY_ANCHOR.get(event.target.closest(".thumbnail").id)));
grid.addEventListener("click", (event) => {
  const button = event.target.closest("button.more");
  if (!button) return;
  const item = button.closest(".thumbnail"), card = BY_ANCHOR.get(item.id);
  card.open = !card.open;
  tell(item, card);
  draw();
});
// The target of a link is shown, whatever is searched for.
function arrive() {
  const card = BY_ANCHOR.get(decodeURIComponent(location.hash.slice(1)));
  if (!card) return;
  if (!places.has(card)) {
    [find, ...choices].forEach((control) => { control.value = ""; });
    colour = "";
    update();
  }
  settle(card);
  reach(card, true);
  grid.querySelectorAll(".here").forEach((one) => one.classList.remove("here"));
  live.get(card).classList.add("here");
}

singleKeys(() => undefined);
[find, sort, ...choices].forEach((control) => control.addEventListener("input", update));
document.querySelectorAll("[data-choose]").forEach((button) => {
  button.onclick = () => { colour = button.dataset.choose; update(); };
});
let due = 0;
addEventListener("scroll", () => {
  cancelAnimationFrame(due);
  due = requestAnimationFrame(draw);
}, { passive: true });
new ResizeObserver(draw).observe(document.documentElement);
addEventListener("hashchange", arrive);
// Paper has all of them.
addEventListener("beforeprint", () => {
  put(order);
  printing = true;
});
addEventListener("afterprint", () => {
  printing = false;
  draw();
});
update();
arrive();
