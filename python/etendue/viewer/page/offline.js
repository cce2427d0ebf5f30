// In a file of its own there is no program behind the page: this stands in for server.js, and asks nobody.

export function serverOf() {
  return {
    async map() {
      throw new Error("This file works without the program, which alone writes maps: see the command.");
    },
    async refine() {},
    stop() {},
  };
}
