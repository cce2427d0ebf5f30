// The program behind the page, where there is one: it answers on this machine's own address only.

export function serverOf() {
  let running = null;

  async function ask(path, body, signal) {
    const headers = { "Content-Type": "application/json" };
    const response = await fetch(path, { method: "POST", headers, body: JSON.stringify(body), signal });
    if (!response.ok) throw new Error(await response.text());
    return response;
  }

  const screenOf = ({ theta, phi, distance, target, upright, roll, width, height, columns, rows }) => ({
    observer: { theta, phi, distance, target, up: upright, roll },
    screen: { width, height, columns, rows },
  });

  return {
    /** The map of a view in a file format, worked out by the core. */
    async map(view, format, look) {
      const response = await ask("map", { ...screenOf(view), format, logarithmic: look.logarithmic });
      return response.blob();
    },

    /** The view by lines of sight through the scene: `show(words, map)` with each pass, `map` null between them. */
    async refine(view, show) {
      running?.abort();
      running = new AbortController();
      const { signal } = running;
      try {
        await ask("refine", screenOf(view), signal);
        for (let number = 0, done = false; !done; ) {
          const found = await (await ask("refined", { number }, signal)).json();
          ({ number, done } = found);
          show(found.words, found.map);
        }
      } catch (error) {
        if (error.name !== "AbortError") show(error.message, null);
      }
    },

    stop() {
      running?.abort();
      running = null;
    },
  };
}
