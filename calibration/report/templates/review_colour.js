// Colours in figures and words; formulas and words are those of `metamer match`.
const RADIANS = Math.PI / 180, GREY = 5, NEAR = 10, FAR = 60, PAST = 15, WORTH = 0.3, SPOKEN_FROM = 0.5;

// CIE 142-2001.
function deltaE2000(first, second) {
  const meanChroma7 = ((Math.hypot(first[1], first[2]) + Math.hypot(second[1], second[2])) / 2) ** 7;
  const stretch = 1 + 0.5 * (1 - Math.sqrt(meanChroma7 / (meanChroma7 + 25 ** 7)));
  const [a1, a2] = [first[1] * stretch, second[1] * stretch];
  const [c1, c2] = [Math.hypot(a1, first[2]), Math.hypot(a2, second[2])];
  const hue = (b, a) => (Math.atan2(b, a) / RADIANS + 360) % 360;
  const [h1, h2] = [hue(first[2], a1), hue(second[2], a2)], grey = c1 * c2 === 0;
  let turned = grey ? 0 : h2 - h1;
  if (turned > 180) turned -= 360;
  if (turned < -180) turned += 360;
  const lightness = (first[0] + second[0]) / 2 - 50, chroma = (c1 + c2) / 2;
  let mean = h1 + h2;
  if (!grey) mean = Math.abs(h1 - h2) <= 180 ? mean / 2 : (mean + (mean < 360 ? 360 : -360)) / 2;
  const cosine = (degrees) => Math.cos(degrees * RADIANS);
  const t = 1 - 0.17 * cosine(mean - 30) + 0.24 * cosine(2 * mean) + 0.32 * cosine(3 * mean + 6) - 0.2 * cosine(4 * mean - 63);
  const lightTerm = (second[0] - first[0]) / (1 + 0.015 * lightness ** 2 / Math.sqrt(20 + lightness ** 2));
  const chromaTerm = (c2 - c1) / (1 + 0.045 * chroma);
  const hueTerm = 2 * Math.sqrt(c1 * c2) * Math.sin(turned / 2 * RADIANS) / (1 + 0.015 * chroma * t);
  const bend = -Math.sin(60 * RADIANS * Math.exp(-(((mean - 275) / 25) ** 2))) * 2 * Math.sqrt(chroma ** 7 / (chroma ** 7 + 25 ** 7));
  return Math.sqrt(lightTerm ** 2 + chromaTerm ** 2 + hueTerm ** 2 + bend * chromaTerm * hueTerm);
}

// Direction of a colour from another in words, the largest difference first.
function direction(from, to) {
  const [a, b] = [to[1] - from[1], to[2] - from[2]], [c1, c2] = [Math.hypot(from[1], from[2]), Math.hypot(to[1], to[2])];
  const turned = Math.atan2(from[1] * to[2] - from[2] * to[1], from[1] * to[1] + from[2] * to[2]) / RADIANS;
  const hue = (Math.atan2(from[2], from[1]) / RADIANS + 360) % 360;
  const forth = Math.floor((hue + NEAR) / 90) + 1, back = Math.ceil((hue - NEAR) / 90) - 1;
  const past = turned >= 0 ? hue + turned > 90 * forth + PAST : hue + turned < 90 * back - PAST;
  const parts = [[to[0] - from[0], "lighter", "darker"]];
  if (c1 < GREY || Math.abs(turned) > FAR || past) parts.push([a, "redder", "greener"], [b, "yellower", "bluer"]);
  else {
    const towards = ["redder", "yellower", "greener", "bluer"], hueShare = 2 * Math.sqrt(c1 * c2) * Math.sin(turned / 2 * RADIANS);
    parts.push([c2 - c1, "stronger", "greyer"], [hueShare, towards[forth % 4], towards[(back + 4) % 4]]);
  }
  const named = parts.map(([value, more, less]) => [Math.abs(value), value > 0 ? more : less]).sort((x, y) => y[0] - x[0]);
  const worth = Math.max(WORTH * named[0][0], SPOKEN_FROM);
  return named.filter(([size]) => size >= worth).map(([, word]) => word).join(", ") || "alike";
}

const colourOf = (material, light) => (material.colours[chosen.observer] || {})[light];
const adaptedOf = (material, light) => { const it = colourOf(material, light); return it ? it.adapted : null; };
function shiftOf(material, light) { const it = colourOf(material, light); return it ? it.shift : null; }
function worstShift(material) {
  const found = LIGHTS.filter((light) => light.id !== DATA.from).map((light) => [shiftOf(material, light.id), light]);
  return found.filter(([shift]) => shift).sort((x, y) => y[0].deltaE - x[0].deltaE)[0] || null;
}
const chromaOf = (lab) => Math.hypot(lab[1], lab[2]), hueOf = (lab) => (Math.atan2(lab[2], lab[1]) / RADIANS + 360) % 360;
function lchWords(colour) {
  if (!colour) return "colour not known";
  const chroma = chromaOf(colour.lab);
  return `L* ${tenths(colour.lab[0])}  C* ${chroma.toFixed(1)}` + (chroma < 3 ? "  grey" : `  h ${hueOf(colour.lab).toFixed(0)}°`);
}
const rgb = (codes) => (codes ? `rgb(${codes.join(",")})` : "transparent");

const ICONS = { pass: "i-ok", near: "i-near", over: "i-warn" };
const worstError = (material) => Math.max(...Object.values(material.rows).map((row) => row.p99));

// Limits of a picture's reliability, in plain words, the most important first.
function limitsOf(material, light) {
  const row = material.rows[light], found = [];
  if (!row) return found;
  if (row.undefined) found.push(["Pixels without a number", `${row.undefined} pixels hold no number: they are in no figure.`]);
  if (row.status !== "pass") {
    const title = row.status === "near" ? "Rendering error borderline" : "Rendering error too large";
    found.push([title, `1 % of the surface is ΔE94 ${error(row.p99)} or more away from the reference; the limit is ${DATA.limit}.`]);
  }
  if (material.standing.colour === "uplifted" && light !== DATA.from) {
    found.push(["Colour guessed", "Its spectrum was made up from RGB values: under this light the colour is a guess."]);
  }
  const limits = row.limits;
  if (!limits) found.push(["Not known what the screen cannot show", "The display view hides where colours leave its range."]);
  else {
    if (limits.below >= DATA.saidFrom) {
      const off = limits.off === null ? "" : `ΔE2000 ${limits.off.toFixed(1)} on average.`;
      const more = !off ? "" : limits.black > 0 ? ` With what is darker than its black, it is off by ${off}` : ` The real one is stronger, by ${off}`;
      found.push([`Too strong for this screen: ${percent(limits.below)}`, `${percent(limits.below)} of the surface is a colour that ${DATA.screen} cannot show.${more}`]);
    }
    if (limits.black >= DATA.saidFrom) {
      found.push([`Darker than this screen's black: ${percent(limits.black)}`, `${percent(limits.black)} of the surface is darker than the black of ${DATA.screen}, which is shown in its place.`]);
    }
    if (limits.above >= DATA.saidFrom) {
      found.push([`Highlight cut at white: ${percent(limits.above)}`, `${percent(limits.above)} of the surface is brighter than this screen can show. Its shape is right, its colour cannot be read there.`]);
    }
  }
  return found;
}
function trouble(material) {
  const rows = Object.values(material.rows), holes = rows.reduce((sum, row) => sum + row.undefined, 0);
  const over = Math.max(0, worstError(material) - DATA.limit);
  const share = (name) => 100 * Math.max(...rows.map((row) => (row.limits ? row.limits[name] : 0)));
  return 1e6 * (holes > 0) + 1e3 * over + share("below") + 0.5 * share("above") + 0.5 * share("black") + worstError(material);
}
