// Paper: a summary to sign, then twelve pictures a page.
const COLOUR_IS = { measured: "measured", analytic: "calculated", uplifted: "guessed", reconstructed: "rebuilt", unknown: "not stated" };

function sheet() {
  const light = chosen.light, list = shown.map((tile) => tile.material), name = `${LIGHT[light].name} (${light})`;
  const lab = (material) => (colourOf(material, DATA.from) || colourOf(material, light) || { lab: null }).lab;
  const lines = list.map((material) => {
    const worst = worstShift(material), limits = limitsOf(material, light), values = lab(material);
    return `<tr><th>${escaped(material.name)}</th><td>${COLOUR_IS[material.standing.colour]}</td>`
      + PICTURED.map((each) => `<td><i class="chip" style="background:${rgb((colourOf(material, each.id) || {}).swatch)}"></i></td>`).join("")
      + (values ? values.map((value) => `<td class="num">${tenths(value)}</td>`).join("") : '<td colspan="3">not known</td>')
      + `<td class="num">${error(worstError(material))}</td><td class="whole">${worst ? `${worst[0].deltaE.toFixed(1)} ${escaped(worst[1].id)}` : "–"}</td>`
      + `<td class="doubt">${limits.map((limit) => limit[0]).join("; ") || "–"}</td><td class="whole"><i class="box"></i>yes<i class="box"></i>no</td></tr>`;
  }).join("");
  const head = `<thead><tr><th>Material</th><th>Colour is</th>${PICTURED.map((each) => `<th>${escaped(each.id)}</th>`).join("")}<th class="num">L*</th><th class="num">a*</th><th class="num">b*</th><th class="num">Rendering error (99 %)</th><th>Moves most</th><th>Doubtful</th><th>Decision</th></tr></thead>`;
  let html = `<h1>${escaped(DATA.title)}</h1><p class="verdict">${escaped(DATA.verdict)}</p><p class="facts">${escaped(DATA.facts)} Pictures on this sheet: ${escaped(name)}. L* a* b*: daylight ${DATA.from}, ${chosen.observer} observer. Moves most: ΔE2000 from daylight, after adaptation. Paper does not show these colours exactly: decide on the sample or on a calibrated screen.</p>`
    + `<table>${head}<tbody>${lines}</tbody></table><div class="sign"><div>Project, part</div><div>Decided by</div><div>Date</div><div>Remarks</div></div>`;
  for (let at = 0; at < list.length; at += 12) {
    const figures = list.slice(at, at + 12).map((material) => {
      const limits = limitsOf(material, light), moves = PICTURED.filter((each) => each.id !== DATA.from).map((each) => [each, shiftOf(material, each.id)]);
      return `<figure><div class="stage"><img data-picture="${material.pictures[light] ? material.pictures[light].address("p") : ""}" alt=""></div><b>${escaped(material.name)}</b>${lchWords(colourOf(material, light))}`
        + moves.filter(([, shift]) => shift).map(([each, shift]) => `<br>${escaped(each.id)}: ${shift.deltaE.toFixed(1)} ${shift.words}`).join("")
        + (limits.length ? `<br><strong>! ${limits[0][0]}</strong>` : "") + "</figure>";
    }).join("");
    html += `<section class="pics"><h2>Pictures ${at + 1} to ${Math.min(at + 12, list.length)} · ${escaped(name)}</h2>${figures}</section>`;
  }
  filled(one("#sheet"), html);
}
addEventListener("beforeprint", sheet);
