// The panel beside the picture: what stands in it, and what its fields say.

import { measured, plain, prefixed, typed, withUnit } from "./numbers.js";

export const $ = (id) => document.getElementById(id);

/** Fills an element with a table of rows [name, value]. */
function tableOf(title, rows, remove) {
  const table = document.createElement("table");
  const caption = table.createCaption();
  caption.append(title);
  const button = document.createElement("button");
  button.textContent = "×";
  button.title = "Remove this region";
  button.addEventListener("click", remove);
  caption.append(button);
  for (const [name, value] of rows) {
    const row = table.insertRow();
    const head = document.createElement("th");
    head.textContent = name;
    row.append(head);
    row.insertCell().textContent = value;
  }
  return table;
}

/** The figures of a region in words. */
export function regionRows(figures, unit, fluxUnit) {
  if (!figures) return [["", "…"]];
  if (figures.pixels === 0) return [["", "no pixel has its middle in it"]];
  if (figures.pixels === figures.dead) return [["", "all its pixels are dead: no ray came"]];
  const intensityUnit = fluxUnit === "lm" ? "cd" : "W/sr";
  const luminance = unit.includes("sr") || unit.startsWith("cd");
  const [low, middle, high] = figures.percentiles;
  const rows = [
    ["mean", measured(figures.mean, figures.error, unit)],
    ["maximum", withUnit(figures.maximum, unit)],
    ["minimum", withUnit(figures.minimum, unit)],
    ["5 %, median, 95 %", `${[low, middle, high].map((x) => plain(x / prefixed(middle || high, unit)[0], 3)).join("  ")} ${prefixed(middle || high, unit)[1]}`],
    ["uniformity min/mean", plain(figures.uniformity, 3)],
    ["min/max", plain(figures.diversity, 3)],
  ];
  if (luminance) rows.push(["intensity", withUnit(figures.intensity, intensityUnit)]);
  if (figures.flux) rows.push(["flux, all directions", measured(figures.flux.value, figures.flux.error, fluxUnit)]);
  const dead = figures.dead > 0 ? `, ${figures.dead} dead, as 0` : "";
  rows.push(["area", `${plain(figures.area, 4)} mm²`], ["pixels", `${figures.pixels}${dead}`]);
  if (figures.cut) rows.push(["beyond the picture", "not counted"]);
  return rows;
}

export function showRegions(regions, unit, fluxUnit, remove) {
  $("regions-box").hidden = regions.length === 0;
  $("regions").replaceChildren(
    ...regions.map((region, i) =>
      tableOf(`${i + 1}  ${region.kind}`, regionRows(region.figures, unit, fluxUnit), () => remove(region)),
    ),
  );
}

/** Lets a field set a number; a text that is none, or that `allowed` refuses, is marked and changes nothing. */
export function numberField(id, allowed, changed) {
  const field = $(id);
  field.addEventListener("change", () => {
    const value = typed(field.value);
    const fine = Number.isFinite(value) && allowed(value);
    field.classList.toggle("wrong", !fine);
    if (fine) changed(value);
  });
  return (value, digits = 5) => {
    if (document.activeElement === field) return;
    field.classList.remove("wrong");
    field.value = Number(value.toPrecision(digits)).toString().replace("-", "−");
  };
}

/** Hands a file to the user. */
export function save(name, parts, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob(parts, { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
