// A slider between two pictures: `window.comparePictures(title, left, right)` opens it; arrow keys or a pointer move it.
(function () {
  "use strict";
  const box = document.getElementById("compare"), slider = box.querySelector("input"), stack = box.querySelector(".stack");
  const pictures = box.querySelectorAll("img"), sides = box.querySelectorAll(".sides span");

  function place() { stack.style.setProperty("--at", slider.value + "%"); }

  window.comparePictures = function (title, left, right) {
    box.querySelector("h2").textContent = title;
    [left, right].forEach(function (shown, index) {
      [pictures[index].src, pictures[index].alt, sides[index].textContent] = [shown.src, shown.alt, shown.name];
    });
    slider.value = 50;
    place();
    box.showModal();
    slider.focus();
  };
  slider.addEventListener("input", place);
  stack.addEventListener("pointermove", function (event) {
    const bounds = stack.getBoundingClientRect();
    slider.value = 100 * (event.clientX - bounds.left) / bounds.width;
    place();
  });
})();
