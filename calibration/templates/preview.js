(function () {
  "use strict";
  var sheet = document.getElementById("sheet"), shown = document.getElementById("shown"), none = document.getElementById("none");
  var find = document.getElementById("find"), sort = document.getElementById("sort");
  var choices = ["family", "kind", "quantity"].map(function (id) { return document.getElementById(id); });
  var all = Array.prototype.slice.call(sheet.children).map(function (card) {
    return { card: card, text: card.textContent.toLowerCase() };
  });
  var falling = { p99: true, chroma: true };

  function before(a, b) {
    var key = sort.value;
    if (key !== "id") {
      var first = Number(a.card.dataset[key]), second = Number(b.card.dataset[key]);
      // What has no number comes last, whichever way the others run.
      if ((first < 0) !== (second < 0)) return first < 0 ? 1 : -1;
      if (first !== second) return falling[key] ? second - first : first - second;
    }
    return a.card.dataset.id.localeCompare(b.card.dataset.id, undefined, { numeric: true });
  }

  function update() {
    var words = find.value.toLowerCase().split(/\s+/).filter(Boolean), count = 0;
    all.sort(before).forEach(function (one) {
      var fits = words.every(function (word) { return one.text.indexOf(word) >= 0; }) &&
        choices.every(function (choice) { return !choice.value || one.card.dataset[choice.id] === choice.value; });
      one.card.hidden = !fits;
      count += fits;
      sheet.appendChild(one.card);
    });
    shown.textContent = count + " of " + all.length + " materials";
    none.hidden = count > 0;
  }
  [find, sort].concat(choices).forEach(function (control) { control.addEventListener("input", update); });
  update();
})();
