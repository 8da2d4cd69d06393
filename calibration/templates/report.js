// Search, sort, the way by keyboard, and the reference in the place of the picture.
(function () {
  "use strict";
  document.documentElement.classList.add("scripted");
  const [find, show, sort, toggle, shown, cards] = ["find", "show", "sort", "reference", "shown", "cards"].map(function (id) {
    return document.getElementById(id);
  });
  const leftOut = document.getElementById("left-out"), table = document.querySelector(".matrix tbody");
  const all = Array.from(cards.querySelectorAll(".card")).map(function (card) {
    const line = table.querySelector('[data-card="' + card.id + '"]');
    const rows = Array.from(card.querySelectorAll(".row"));
    const cells = rows.map(function (row) { return line.querySelector('td[data-light="' + CSS.escape(row.dataset.light) + '"]'); });
    return { card: card, line: line, link: line.querySelector("a"), rows: rows, cells: cells };
  });
  const lights = new Set(Array.from(cards.querySelectorAll(".row"), function (row) { return row.dataset.light.toLowerCase(); }));
  let order = all.slice();

  // A word that is the name of a light means that light; any other stands somewhere in material, light or verdict.
  function fits(one, row, words) {
    const said = [one.card.dataset.name, row.dataset.light, row.dataset.words, row.dataset.status].join(" ").toLowerCase();
    return (!show.value || row.dataset.status === show.value) && words.every(function (word) {
      return lights.has(word) ? row.dataset.light.toLowerCase() === word : said.includes(word);
    });
  }

  // What a card is sorted by: pixels without a number, then the largest figure of its rows, of one light where asked.
  function badness(one) {
    const light = sort.selectedOptions[0].dataset.light;
    const rows = one.rows.filter(function (row) { return !row.hidden && (!light || row.dataset.light === light); });
    const largest = function (key) { return Math.max.apply(null, [-1].concat(rows.map(function (row) { return Number(row.dataset[key]); }))); };
    return [Math.min(largest("undefined"), 1), largest(sort.value === "mean" ? "mean" : "p99")];
  }

  function before(a, b) {
    if (sort.value === "name") return a.card.dataset.name.localeCompare(b.card.dataset.name, undefined, { numeric: true });
    const one = a.card.dataset.order - b.card.dataset.order;
    if (sort.value === "order") return one;
    return b.bad[0] - a.bad[0] || b.bad[1] - a.bad[1] || one;
  }

  // Whatever stands where it should is left alone: each element that moves has to be laid out again.
  function arrange(wanted) {
    let card = null, line = null;
    wanted.forEach(function (one) {
      const [nextCard, nextLine] = [card ? card.nextElementSibling : cards.firstElementChild, line ? line.nextElementSibling : table.firstElementChild];
      if (nextCard !== one.card) cards.insertBefore(one.card, nextCard);
      if (nextLine !== one.line) table.insertBefore(one.line, nextLine);
      [card, line] = [one.card, one.line];
    });
    order = wanted;
  }

  function update() {
    const words = find.value.toLowerCase().split(/\s+/).filter(Boolean);
    let rows = 0, left = 0;
    all.forEach(function (one) {
      one.rows.forEach(function (row, index) {
        row.hidden = !fits(one, row, words);
        one.cells[index].classList.toggle("out", row.hidden);
        left += !row.hidden;
        rows += 1;
      });
      one.card.hidden = one.line.hidden = one.rows.every(function (row) { return row.hidden; });
      one.bad = badness(one);
    });
    arrange(all.slice().sort(before));
    order = order.filter(function (one) { return !one.card.hidden; });
    const says = order.length + " of " + all.length + " materials, " + left + " of " + rows + " rows";
    shown.textContent = left === rows ? all.length + " materials, " + rows + " rows" : left ? says : "Nothing fits.";
    leftOut.textContent = left < rows ? "Only a part of the review is shown: " + says + "." : "";
    settle(links, order[0]);
    settle(pages, order[0]);
  }
  [find, show, sort].forEach(function (control) { control.addEventListener("input", update); });

  // One tab stop for all names and one for all cards; arrow keys move it, and only the card that has it lets Tab in.
  const links = { of: function (one) { return one.link; }, now: null };
  const pages = { of: function (one) { return one.card; }, now: null };

  function settle(group, one) {
    if (group.now && !group.now.card.hidden) return;
    move(group, one || null);
  }

  function move(group, one) {
    if (group.now) open(group, group.now, -1);
    group.now = one;
    if (one) open(group, one, 0);
  }

  function open(group, one, tabIndex) {
    group.of(one).tabIndex = tabIndex;
    if (group === pages) one.card.querySelectorAll("a, button").forEach(function (each) { each.tabIndex = tabIndex; });
  }

  function arrows(group, place, back, forth) {
    place.addEventListener("keydown", function (event) {
      const step = event.key === forth ? 1 : event.key === back ? -1 : 0;
      if (!step || !group.now || event.target !== group.of(group.now)) return;
      const next = order[order.indexOf(group.now) + step];
      event.preventDefault();
      if (!next) return;
      move(group, next);
      group.of(next).focus();
    });
    place.addEventListener("focusin", function (event) {
      const one = all.find(function (each) { return group.of(each).contains(event.target); });
      if (one && one !== group.now) move(group, one);
    });
  }
  all.forEach(function (one) {
    open(links, one, -1);
    open(pages, one, -1);
  });

  function compare(row) {
    const picture = row.querySelector("img.hold"), hold = figures.find(function (one) { return one.picture === picture; });
    const name = row.closest(".card").dataset.name + " under " + row.dataset.light;
    window.comparePictures(name, { src: hold.own[0], alt: hold.own[1], name: "Picture" }, { src: hold.other[0], alt: hold.other[1], name: "Reference" });
  }
  cards.addEventListener("click", function (event) {
    if (event.target.classList.contains("compare-open")) compare(event.target.closest(".row"));
  });
  cards.addEventListener("keydown", function (event) {
    if (event.key.toLowerCase() !== "c" || event.ctrlKey || event.metaKey || event.altKey) return;
    const row = event.target.closest(".row") || event.target.querySelector(".row:not([hidden])");
    if (row) compare(row);
  });
  arrows(links, table, "ArrowUp", "ArrowDown");
  arrows(pages, cards, "ArrowLeft", "ArrowRight");
  update();

  // The reference in the place of the picture: side by side, small differences hide.
  const figures = Array.from(document.querySelectorAll("img.hold"), function (picture) {
    const reference = picture.parentNode.nextElementSibling.querySelector("img");
    return { figure: picture.parentNode, picture: picture, own: [picture.src, picture.alt], other: [reference.src, reference.alt] };
  });
  const near = new Set();
  let swapped = false;

  function set(one, on) {
    [one.picture.src, one.picture.alt] = on ? one.other : one.own;
    one.figure.classList.toggle("swapped", on);
  }

  function swap(on) {
    swapped = on;
    // Only what is on the screen: a page may have hundreds.
    near.forEach(function (one) { set(one, on); });
  }
  const watcher = new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      const one = figures.find(function (each) { return each.figure === entry.target; });
      if (entry.isIntersecting) near.add(one); else near.delete(one);
      if (entry.isIntersecting && one.figure.classList.contains("swapped") !== swapped) set(one, swapped);
    });
  });
  figures.forEach(function (one) {
    watcher.observe(one.figure);
    one.picture.addEventListener("pointerdown", function () { set(one, !swapped); });
    ["pointerup", "pointerleave", "pointercancel"].forEach(function (kind) {
      one.picture.addEventListener(kind, function () { set(one, swapped); });
    });
    ["dragstart", "contextmenu"].forEach(function (kind) {
      one.picture.addEventListener(kind, function (event) { event.preventDefault(); });
    });
  });
  toggle.addEventListener("input", function () { swap(toggle.checked); });
  document.addEventListener("keydown", function (event) {
    if (event.key === "Shift" && !event.repeat && event.target !== find) swap(!toggle.checked);
  });
  document.addEventListener("keyup", function (event) { if (event.key === "Shift") swap(toggle.checked); });
  window.addEventListener("blur", function () { swap(toggle.checked); });
})();
