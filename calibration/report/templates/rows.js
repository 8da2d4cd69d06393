// Rows of a page: search, sort, the way by keyboard, and links to each of them.
//
// Each line of the table (`data-line`, the id of its card where it has one) is one thing. Its rows are the card's, or the
// line itself: they say what is searched (`data-words`), shown (`data-status`, one or more; `data-...` by the name of a
// `.choice`) and sorted (`data-...` by the values of #sort, the largest first; `data-undefined` before all).
(function () {
  "use strict";
  document.documentElement.classList.add("scripted");
  const [find, show, sort, shown, cards, leftOut] = ["find", "show", "sort", "shown", "cards", "left-out"].map(function (id) {
    return document.getElementById(id);
  });
  const lines = Array.from(document.querySelectorAll("[data-line]")), table = lines.length ? lines[0].parentNode : null;
  const all = lines.map(function (line, index) {
    const card = line.dataset.line ? document.getElementById(line.dataset.line) : null;
    const rows = card ? Array.from(card.querySelectorAll(".row")) : [line];
    const cells = rows.map(function (row) { return row.dataset.light && line.querySelector('[data-light="' + CSS.escape(row.dataset.light) + '"]'); });
    const said = card || line, name = said.dataset.name || "";
    const texts = rows.map(function (row) {
      return " " + wordsOf([name, row.dataset.light, row.dataset.words, row.dataset.status].join(" ")).join(" ");
    });
    return { card: card, line: line, link: line.querySelector("th a"), rows: rows, texts: texts, cells: cells, name: name, order: Number(said.dataset.order || index) };
  });
  const lights = new Set(all.flatMap(function (one) { return one.rows.map(function (row) { return (row.dataset.light || "").toLowerCase(); }); }));
  const things = shown.dataset.things || "materials";
  const MOST = { line: 50, card: 6 };
  let order = all.slice(), revealed = Object.assign({}, MOST);

  const choices = Array.from(document.querySelectorAll("select.choice"));
  const byName = new Intl.Collator(undefined, { numeric: true }).compare;

  // A word that is the name of a light means that light; with any other, a word of material, light or verdict begins:
  // "red" is in "redder", not in "measured".
  function fits(one, index, words) {
    const row = one.rows[index];
    return (!show || !show.value || (" " + row.dataset.status + " ").includes(" " + show.value + " ")) &&
      choices.every(function (choice) { return !choice.value || row.dataset[choice.name] === choice.value; }) &&
      words.every(function (word) {
        return lights.has(word) ? row.dataset.light.toLowerCase() === word : one.texts[index].includes(" " + word);
      });
  }

  // Sort key: pixels without a number, then the largest figure of the rows, of one light where asked.
  function badness(one) {
    const chosen = sort.selectedOptions[0], light = chosen.dataset.light;
    const rows = one.rows.filter(function (row) { return !row.hidden && (!light || row.dataset.light === light); });
    const largest = function (key) { return Math.max.apply(null, [-1].concat(rows.map(function (row) { return Number(row.dataset[key] || 0); }))); };
    return [Math.min(largest("undefined"), 1), largest(sort.value)];
  }

  function before(a, b) {
    if (sort.value === "name") return byName(a.name, b.name);
    const one = a.order - b.order;
    if (sort.value === "order") return one;
    return b.bad[0] - a.bad[0] || (b.bad[1] > a.bad[1]) - (b.bad[1] < a.bad[1]) || one;
  }

  // Whatever stands where it should is left alone: each element that moves has to be laid out again.
  function arrange(kind, wanted) {
    let last = null;
    wanted.forEach(function (one) {
      const each = one[kind];
      if (!each) return;
      const next = last ? last.nextElementSibling : each.parentNode.querySelector(kind === "line" ? "[data-line]" : ".card");
      if (next !== each) each.parentNode.insertBefore(each, next);
      last = each;
    });
  }

  function update() {
    const words = wordsOf(find.value);
    let rows = 0, left = 0;
    all.forEach(function (one) {
      one.rows.forEach(function (row, index) {
        const out = !fits(one, index, words);
        if (row.hidden !== out) {
          row.hidden = out;
          if (one.cells[index]) one.cells[index].classList.toggle("out", out);
        }
        left += !row.hidden;
        rows += 1;
      });
      const gone = one.rows.every(function (row) { return row.hidden; });
      if (one.line.hidden !== gone) one.line.hidden = gone;
      if (one.card && one.card.hidden !== gone) one.card.hidden = gone;
      one.bad = badness(one);
    });
    order = all.filter(function (one) { return !one.line.hidden; }).sort(before);
    ["line", "card"].forEach(function (kind) { reveal(kind, MOST[kind]); });
    const alone = rows === all.length, total = all.length + " " + things + (alone ? "" : ", " + rows + " rows");
    const says = order.length + " of " + all.length + " " + things + (alone ? "" : ", " + left + " of " + rows + " rows");
    shown.textContent = left === rows ? total : left ? says : "No matches.";
    if (leftOut) leftOut.textContent = left < rows ? "Only a part is shown: " + says + "." : "";
    settle(links);
    settle(pages);
  }
  [find, show, sort].concat(choices).filter(Boolean).forEach(function (control) { control.addEventListener("input", update); });

  // On a screen, only so many are put in order and laid out until somebody comes to their end; paper has all.
  function reveal(kind, most) {
    revealed[kind] = most;
    arrange(kind, order.slice(0, most));
    const early = new Set(order.slice(0, most));
    all.forEach(function (one) {
      if (one[kind] && one[kind].classList.contains("late") === early.has(one)) one[kind].classList.toggle("late", !early.has(one));
    });
  }

  function reach(kind, one) {
    const at = order.indexOf(one);
    if (at >= revealed[kind]) reveal(kind, at + MOST[kind]);
  }

  function grows(kind, place) {
    const end = document.createElement("div");
    end.className = "end";
    place.after(end);
    const watcher = new IntersectionObserver(function (entries) {
      if (!entries.some(function (entry) { return entry.isIntersecting; }) || revealed[kind] >= order.length) return;
      reveal(kind, revealed[kind] + MOST[kind]);
      // An end that stays on the screen fires no further event.
      watcher.unobserve(end);
      watcher.observe(end);
    }, { rootMargin: "900px" });
    watcher.observe(end);
  }

  // One tab stop for all names and one for all cards; arrow keys move it, and only the card that has it lets Tab in.
  const links = { kind: "line", of: function (one) { return one.link; }, now: null };
  const pages = { kind: "card", of: function (one) { return one.card; }, now: null };

  function settle(group) {
    if (group.now && !group.now.line.hidden) return;
    move(group, order.find(group.of) || null);
  }

  function move(group, one) {
    if (group.now) open(group, group.now, -1);
    group.now = one;
    if (one) open(group, one, 0);
  }

  function open(group, one, tabIndex) {
    group.of(one).tabIndex = tabIndex;
    if (group === pages) one.card.querySelectorAll("a, button, input, summary, .scroll").forEach(function (each) { each.tabIndex = tabIndex; });
  }

  function arrows(group, place, back, forth) {
    place.addEventListener("keydown", function (event) {
      const step = event.key === forth ? 1 : event.key === back ? -1 : 0;
      if (!step || !group.now || event.target !== group.of(group.now)) return;
      const able = order.filter(group.of), next = able[able.indexOf(group.now) + step];
      event.preventDefault();
      if (!next) return;
      reach(group.kind, next);
      move(group, next);
      // A card is higher than many a screen: its head is what is seen.
      group.of(next).focus({ preventScroll: group === pages });
      if (group === pages) land(next.card);
    });
    place.addEventListener("focusin", function (event) {
      const one = all.find(function (each) { return group.of(each) && group.of(each).contains(event.target); });
      if (one && one !== group.now) move(group, one);
    });
  }
  [links, pages].forEach(function (group) {
    all.filter(group.of).forEach(function (one) { open(group, one, -1); });
  });

  // The target of a link is shown, whatever is searched for.
  function arrive() {
    const id = decodeURIComponent(location.hash.slice(1)), target = id && document.getElementById(id);
    const one = target && all.find(function (each) { return (each.card || each.line).contains(target); });
    if (!one) return;
    const row = target.closest(".row") || target;
    if (row.hidden || one.line.hidden) {
      [find].concat(show || [], choices).forEach(function (control) { control.value = ""; });
      update();
    }
    const group = one.card ? pages : links;
    reach(group.kind, one);
    move(group, one);
    land(row);
  }

  // Cards get their own height, and the table more lines, only as they come near the screen: what a link leads to is held
  // where it should be until nothing moves it any more, or somebody scrolls.
  let landing = null;
  function land(row) {
    let still = 0, frames = 0, last = null;
    landing = row;
    (function again() {
      if (landing !== row) return;
      row.scrollIntoView({ behavior: "instant" });
      still = window.scrollY === last ? still + 1 : 0;
      last = window.scrollY;
      frames += 1;
      if (still < 6 && frames < 90) requestAnimationFrame(again);
      else landing = null;
    })();
  }
  ["wheel", "touchstart", "pointerdown", "keydown"].forEach(function (kind) {
    window.addEventListener(kind, function () { landing = null; }, { passive: true, capture: true });
  });
  window.addEventListener("hashchange", arrive);
  window.addEventListener("beforeprint", function () { ["line", "card"].forEach(function (kind) { arrange(kind, order); }); });
  if (!table) return;
  arrows(links, table, "ArrowUp", "ArrowDown");
  if (cards) arrows(pages, cards, "ArrowLeft", "ArrowRight");
  else arrows(links, table, "ArrowLeft", "ArrowRight");
  grows("line", table.closest("table") || table);
  if (cards) grows("card", cards);
  update();
  arrive();
})();
