(function () {
  "use strict";
  document.documentElement.classList.add("scripted");
  var find = document.getElementById("find"), show = document.getElementById("show"), sort = document.getElementById("sort");
  var shown = document.getElementById("shown"), cards = document.getElementById("cards");
  var rows = {}, all = Array.prototype.slice.call(cards.querySelectorAll(".card"));
  document.querySelectorAll("tr[data-card]").forEach(function (row) { rows[row.dataset.card] = row; });

  function before(a, b) {
    if (sort.value === "name") return a.dataset.name.localeCompare(b.dataset.name, undefined, { numeric: true });
    if (sort.value === "order") return a.dataset.order - b.dataset.order;
    return b.dataset[sort.value] - a.dataset[sort.value];
  }

  function update() {
    var words = find.value.trim().toLowerCase(), count = 0;
    all.sort(before).forEach(function (card) {
      var fits = card.dataset.name.toLowerCase().indexOf(words) >= 0 && (!show.value || card.dataset.status === show.value);
      var row = rows[card.id];
      row.hidden = !fits;
      card.style.display = fits ? "" : "none";
      count += fits;
      cards.appendChild(card);
      row.parentNode.appendChild(row);
    });
    shown.textContent = count + " of " + all.length + " materials";
  }
  [find, show, sort].forEach(function (control) { control.addEventListener("input", update); });
  update();

  // Hold a picture to see the reference in its place: two pictures side by side hide small differences.
  document.querySelectorAll("img.hold").forEach(function (picture) {
    var own = picture.src, figure = picture.parentNode, reference = figure.nextElementSibling.querySelector("img");
    function set(swapped) {
      picture.src = swapped ? reference.src : own;
      figure.classList.toggle("swapped", swapped);
    }
    picture.addEventListener("pointerdown", function () { set(true); });
    ["pointerup", "pointerleave", "pointercancel"].forEach(function (kind) {
      picture.addEventListener(kind, function () { if (figure.classList.contains("swapped")) set(false); });
    });
    picture.addEventListener("dragstart", function (event) { event.preventDefault(); });
    picture.addEventListener("contextmenu", function (event) { event.preventDefault(); });
  });
})();
