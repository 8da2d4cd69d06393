// A table of pictures, the slider, and one picture in the place of the other.
//
// Where two are to be compared, `.seen` holds both, each in a figure with a `data-name`: `img.hold`, and `img.other`, which
// takes its place while it is held.
(function () {
  "use strict";
  const [find, toggle, cards] = ["find", "reference", "cards"].map(function (id) { return document.getElementById(id); });

  // A table of pictures: those of the cards, each put in when it comes onto the screen.
  const grid = document.getElementById("grid"), matrix = document.querySelector(".matrix");
  const coming = new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      if (!entry.isIntersecting) return;
      const row = document.getElementById(decodeURIComponent(entry.target.parentNode.getAttribute("href").slice(1)));
      const picture = row.querySelector("img.hold") || row.querySelector(".shot img");
      if (!picture) return;
      [entry.target.src, entry.target.alt] = [picture.src, picture.alt];
      coming.unobserve(entry.target);
    });
  }, { rootMargin: "400px" });
  grid.addEventListener("input", function () {
    matrix.classList.toggle("pictures", grid.checked);
    if (!grid.checked || matrix.querySelector(".thumb")) return;
    matrix.querySelectorAll("a.cell").forEach(function (cell) {
      const thumb = document.createElement("img");
      thumb.className = "thumb";
      thumb.alt = "";
      cell.prepend(thumb);
      coming.observe(thumb);
    });
  });

  // The first pair of a place that a search leaves.
  function compare(place) {
    const hold = figures.find(function (one) { return place.contains(one.picture) && !one.picture.closest(".row").hidden; });
    if (!hold) return;
    const row = hold.picture.closest(".row"), light = row.dataset.light, of = hold.place.dataset.of;
    const own = { src: hold.own[0], alt: hold.own[1], name: hold.figure.dataset.name };
    const other = { src: hold.other[0], alt: hold.other[1], name: hold.reference.parentNode.dataset.name };
    const first = hold.picture.compareDocumentPosition(hold.reference) & Node.DOCUMENT_POSITION_FOLLOWING;
    const title = row.closest(".card").dataset.name + (light ? " under " + light : "") + (of ? ", " + of : "");
    window.comparePictures(title, first ? own : other, first ? other : own);
  }
  cards.addEventListener("click", function (event) {
    if (event.target.classList.contains("compare-open")) compare(event.target.closest(".seen"));
  });
  cards.addEventListener("keydown", function (event) {
    if (event.key.toLowerCase() !== "c" || event.ctrlKey || event.metaKey || event.altKey) return;
    compare(event.target.closest(".seen") || event.target.closest(".row") || event.target);
  });

  // One in the place of the other: side by side, small differences hide.
  const figures = Array.from(document.querySelectorAll("img.hold"), function (picture) {
    const place = picture.closest(".seen"), reference = place.querySelector("img.other");
    return { place: place, figure: picture.parentNode, picture: picture, reference: reference, own: [picture.src, picture.alt], other: [reference.src, reference.alt] };
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
