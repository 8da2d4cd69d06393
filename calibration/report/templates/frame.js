// The frame of all pages: the grey around pictures, single keys and their help, and what is folded comes onto paper.
"use strict";
document.documentElement.classList.add("scripted");
const SURROUNDS = ["mid", "light", "dark"];
function setSurround(value) {
  document.documentElement.dataset.surround = value;
  document.querySelectorAll('input[name="surround"]').forEach((input) => { input.checked = input.value === value; });
  try { localStorage.setItem("metamer-surround", value); } catch { /* a page from a file may not keep anything */ }
}
document.getElementById("surround").addEventListener("change", (event) => setSurround(event.target.value));
let keptSurround = null;
try { keptSurround = localStorage.getItem("metamer-surround"); } catch { /* nothing is kept for a page from a file */ }
setSurround(SURROUNDS.includes(keptSurround) ? keptSurround : "mid");

const helpDialog = document.getElementById("help");
document.getElementById("keys").onclick = () => helpDialog.showModal();
const FRAME_KEYS = {
  b: () => setSurround(SURROUNDS[(SURROUNDS.indexOf(document.documentElement.dataset.surround) + 1) % 3]),
  "?": () => helpDialog.showModal(),
  "/": () => document.getElementById("find").focus(),
};
// A page says what its own keys do: an action, null for none, undefined for what all pages do.
function singleKeys(actionOf) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const on = event.target.matches ? event.target : document.body;
    if (on.matches("input[type=search], select, textarea")) {
      if (event.key === "Escape") on.blur();
      return;
    }
    if (helpDialog.open || !document.getElementById("keys-on").checked) return;
    const key = event.key.toLowerCase(), own = actionOf(key), act = own === undefined ? FRAME_KEYS[key] : own;
    if (!act) return;
    event.preventDefault();
    act();
  });
}
// Words that are searched for, and searched: the start of each counts, so that "red" is in "redder" and not in "measured".
function wordsOf(text) { return text.toLowerCase().split(/[\s\/_.,;:()-]+/).filter(Boolean); }
function hasWords(text, words) {
  const own = ` ${wordsOf(text).join(" ")}`;
  return words.every((word) => own.includes(` ${word}`));
}
addEventListener("beforeprint", () => document.querySelectorAll("details.how").forEach((part) => { part.open = true; }));
