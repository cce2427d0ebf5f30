// Numbers as people read them: with the prefix that fits, and no more digits than are known.

const PREFIXES = [
  [1e9, "G"],
  [1e6, "M"],
  [1e3, "k"],
  [1, ""],
  [1e-3, "m"],
  [1e-6, "µ"],
];

/** The factor and the unit in which a value has one to three digits before the point. */
export function prefixed(value, unit) {
  const size = Math.abs(value);
  if (!(size > 0) || !Number.isFinite(size)) return [1, unit];
  const [factor, letter] = PREFIXES.find(([least]) => size >= least * 0.9995) ?? PREFIXES.at(-1);
  return [factor, letter + unit];
}

/** Digits after the point that `digits` significant ones of a number need. */
function decimals(value, digits) {
  const rounded = Math.abs(Number(value.toPrecision(digits)));
  return Math.min(Math.max(digits - 1 - Math.floor(Math.log10(rounded || 1)), 0), 12);
}

/** A plain number of so many significant digits, without an exponent unless it is very large or small. */
export function plain(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e7 || size < 1e-4)) return value.toExponential(digits - 1).replace("-", "−");
  return value.toFixed(decimals(value, digits)).replace("-", "−");
}

/** A value with its unit. */
export function withUnit(value, unit, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const [factor, name] = prefixed(value, unit);
  return `${plain(value / factor, digits)} ${name}`;
}

/** A value with its standard error, both to two digits of the error, and the unit. */
export function measured(value, error, unit) {
  if (!Number.isFinite(value)) return "no value";
  if (!(error > 0) || !Number.isFinite(error)) return withUnit(value, unit);
  const [factor, name] = prefixed(Math.max(value, error), unit);
  const places = Math.min(decimals(error / factor, 2), 6);
  const [v, e] = [value, error].map((x) => (x / factor).toFixed(places).replace("-", "−"));
  return `${v} ± ${e} ${name}`;
}

/** The number that somebody typed, with a comma or a point; NaN if it is none. */
export function typed(text) {
  const cleaned = text.trim().replace(",", ".").replace("−", "-");
  return cleaned === "" ? NaN : Number(cleaned);
}

/** Round numbers from low to high, about `count` of them. */
export function ticks(low, high, count, logarithmic) {
  if (!(high > low)) return [];
  if (logarithmic) {
    const decades = Math.log10(high / low);
    const factors = decades > 2 * count ? [1] : decades > 0.6 * count ? [1] : decades > 1 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9];
    const every = Math.max(1, Math.ceil(decades / count));
    const found = [];
    for (let k = Math.floor(Math.log10(low)); k <= Math.ceil(Math.log10(high)); k += 1) {
      if (every > 1 && k % every !== 0) continue;
      for (const f of factors) {
        const value = f * 10 ** k;
        if (value >= low * 0.9999 && value <= high * 1.0001) found.push(value);
      }
    }
    return found;
  }
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((f) => f * power).find((s) => s >= rough * 0.999);
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) found.push(i * step);
  return found;
}
