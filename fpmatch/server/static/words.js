// Numbers in sentences, as the command line words them.

export function odds(fmr) {
  if (!(fmr > 0 && fmr <= 1)) return "unknown";
  if (fmr > 0.95) return "nearly all";
  const n = 1 / fmr;
  const [unit, word] = n >= 0.9995e9 ? [1e9, " billion"] : n >= 0.9995e6 ? [1e6, " million"] : [1, ""];
  const maximumSignificantDigits = word ? Math.max(2, 1 + Math.floor(Math.log10(n / unit))) : 2;
  return `1 in ${(n / unit).toLocaleString("en", { maximumSignificantDigits })}${word}`;
}

export const count = (n, noun, plural = `${noun}s`) => `${n} ${n === 1 ? noun : plural}`;

export function size(bytes) {
  return bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

// The name of a file without its ending, short enough for a part of another name.
export const stem = (name) => name.replace(/\.[a-z]\w{1,4}$/i, "").slice(0, 60);

const KINDS = ["minutia", "ending", "bifurcation"];

export function minutia([x, y, angle, kind, quality]) {
  const degrees = Math.round((angle * 180) / Math.PI);
  return `${KINDS[kind]} at (${Math.round(x)}, ${Math.round(y)}), direction ${degrees}°, quality ${quality}`;
}

export const place = ([x, y, , kind]) => `${KINDS[kind]} ${Math.round(x)}, ${Math.round(y)}`;

export const pairOf = ({ pairs, probe, reference }, k) =>
  `Pair ${k + 1}: probe ${minutia(probe.minutiae[pairs[k][0]])}; reference ${minutia(reference.minutiae[pairs[k][1]])}`;

export const sentence = (words) => `${words[0].toUpperCase()}${words.slice(1)}.`;
