// A divider between two pictures: dragged, or moved by arrow keys; C leads to that of the row that is looked at.
(function () {
  "use strict";
  const dividers = Array.from(document.querySelectorAll(".compare"));
  // The other picture is in the page once: it is taken from beside the divider as this comes near the screen.
  const watcher = new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      if (!entry.isIntersecting) return;
      const place = entry.target;
      place.querySelector(".top").src = place.closest(".seen").querySelector("img.other").src;
      watcher.unobserve(place);
    });
  }, { rootMargin: "900px" });
  dividers.forEach(function (place) {
    watcher.observe(place);
    const slider = place.querySelector("input");
    slider.addEventListener("input", function () { place.style.setProperty("--x", slider.value + "%"); });
  });
  window.addEventListener("beforeprint", function () {
    dividers.forEach(function (place) { place.querySelector(".top").src = place.closest(".seen").querySelector("img.other").src; });
  });
  window.toDivider = function () {
    const shown = dividers.filter(function (place) { return place.checkVisibility(); });
    const card = document.activeElement.closest(".card");
    const near = shown.find(function (place) { return card && card.contains(place); }) ||
      shown.find(function (place) { return place.getBoundingClientRect().bottom > 80; }) || shown[0];
    if (near) near.querySelector("input").focus();
  };
})();
