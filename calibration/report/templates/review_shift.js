// Colour shift between lights: all materials under all lights, or beside a standard under the same light.
const STEPS = [1, 2, 4, 6], CLOSE = 10;
const step = (deltaE) => `k${STEPS.filter((limit) => deltaE >= limit).length}`;

function pairbox(left, right) {
  return `<span class="pairbox" aria-hidden="true"><i style="background:${rgb(left)}"></i>${right === undefined ? "" : `<i style="background:${rgb(right)}"></i>`}</span>`;
}
function shiftCell(material, light, standard) {
  const own = colourOf(material, light.id), start = colourOf(material, DATA.from);
  const from = standard ? colourOf(standard, light.id) : start;
  if (!own) return '<td class="k">not known</td>';
  if (!standard && light.id === DATA.from) return `<td class="k">${pairbox(own.swatch)}</td>`;
  if (!from || !from.adapted || !own.adapted) return '<td class="k">nothing adapts from this light</td>';
  const deltaE = standard ? deltaE2000(from.adapted, own.adapted) : own.shift.deltaE;
  const words = standard ? direction(from.adapted, own.adapted) : own.shift.words;
  return `<td class="k ${step(deltaE)}"><span class="c">${pairbox(from.swatch, own.swatch)}<b>${deltaE.toFixed(1)}</b><span>${words}</span></span></td>`;
}
// Growth of a pair's difference under some light from daylight.
function spreadFrom(standard, material) {
  const apart = LIGHTS.map((light) => [adaptedOf(standard, light.id), adaptedOf(material, light.id)]).filter(([x, y]) => x && y).map(([x, y]) => deltaE2000(x, y));
  return Math.max(...apart) - inDaylight(standard, material);
}
function inDaylight(standard, material) {
  const [x, y] = [adaptedOf(standard, DATA.from), adaptedOf(material, DATA.from)];
  return x && y ? deltaE2000(x, y) : Infinity;
}

function shifts() {
  const standard = MATERIALS.find((material) => material.id === chosen.standard) || null, table = one("#shift-table");
  let rows = MATERIALS.filter(fits);
  if (standard) {
    rows = rows.filter((material) => material !== standard && inDaylight(standard, material) < CLOSE);
    rows.sort((x, y) => spreadFrom(standard, y) - spreadFrom(standard, x));
  } else rows = rows.map((material) => [worstShift(material), material]).sort((x, y) => (y[0] ? y[0][0].deltaE : 0) - (x[0] ? x[0][0].deltaE : 0)).map((entry) => entry[1]);
  one("#shift-lead").innerHTML = standard
    ? `All of the review within ΔE2000 ${CLOSE} of <b>${escaped(standard.name)}</b> in daylight, and how far each is from it under every light. A pair that is close in daylight and farther apart elsewhere is a metameric pair. The pair that changes most stands first.`
    : "How far each colour moves when the light changes, once the eye has got used to the new light. A small figure means that the colour holds; a large one, that the part will look different in the showroom. The colour that moves most stands first.";
  one("#shift-key").textContent = standard ? "Swatches: left the standard, right this material, under the same light" : "Swatches: left in daylight, right under this light";
  table.querySelector("thead").innerHTML = `<tr><th scope="col">Material</th>${LIGHTS.map((light) =>
    `<th scope="col" class="k">${icon(light.icon)} ${escaped(light.name)}<br><span class="tiny plain-weight">${escaped(light.id)}${light.pictured ? "" : " · figures only"}</span></th>`).join("")}</tr>`;
  const nothing = standard ? `Nothing in this review is within ΔE2000 ${CLOSE} of it in daylight.` : "No material has these words.";
  table.querySelector("tbody").innerHTML = rows.map((material) =>
    `<tr><th scope="row"><button class="link" type="button" data-open="${escaped(material.id)}">${escaped(material.name)}</button><br><span class="tiny soft plain-weight">${escaped(material.standing.badge)}</span></th>`
    + `${LIGHTS.map((light) => shiftCell(material, light, standard)).join("")}</tr>`).join("") || `<tr><td colspan="${LIGHTS.length + 1}">${nothing}</td></tr>`;
}
