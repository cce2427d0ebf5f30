// Colour maps that rise evenly in lightness, so that they can be read without seeing colours and on paper: viridis,
// inferno, cividis and magma of matplotlib (CC0), at 33 even places; between them colours are mixed.

const STOPS = {
  inferno:
    "000004 040312 0b0724 150b37 210c4a 2f0a5b 3d0965 4a0c6b 57106e 64156e 71196e 7d1e6d 8a226a 972766 a32c61 b0315b " +
    "bc3754 c73e4c d24644 db503b e45a31 eb6628 f1731d f68013 f98e09 fb9d07 fcac11 fbbc21 f9cb35 f5db4c f2ea69 f3f68a " +
    "fcffa4",
  viridis:
    "440154 470d60 48186a 482374 472d7b 453781 424086 3e4989 3b528b 375b8d 33638d 2f6b8e 2c728e 297a8e 26828e 23898e " +
    "21918c 1f988b 1fa088 22a785 28ae80 32b67a 3fbc73 4ec36b 5ec962 70cf57 84d44b 98d83e addc30 c2df23 d8e219 ece51b " +
    "fde725",
  cividis:
    "00224e 00285b 002e6a 053371 1a386f 273e6e 32436d 3b496c 434e6c 4b546c 535a6d 5a5f6e 61656f 686a71 6f7073 767676 " +
    "7d7c78 848279 8c8878 938e78 9b9476 a39a74 aba072 b4a76f bcae6c c4b468 cdbb63 d5c25e dec958 e7d150 f0d846 f9e03a " +
    "fee838",
  magma:
    "000004 030312 0a0822 130d34 1d1147 29115a 36106b 440f76 51127c 5d177f 6a1c81 762181 832681 902a81 9c2e7f aa337d " +
    "b73779 c43c75 d0416f dc4869 e75263 ef5d5e f56b5c f9795d fc8961 fd9869 fea772 feb67c fec488 fed395 fde2a3 fcf0b2 " +
    "fcfdbf",
  gray:
    "000000 080808 101010 181818 202020 282828 303030 383838 404040 484848 505050 585858 606060 686868 707070 787878 " +
    "808080 888888 909090 989898 a0a0a0 a8a8a8 b0b0b0 b8b8b8 c0c0c0 c8c8c8 d0d0d0 d8d8d8 e0e0e0 e8e8e8 f0f0f0 f8f8f8 " +
    "ffffff",
};

/** Names of the colour maps. */
export const COLOUR_MAPS = Object.keys(STOPS);

/** The colours of a map, each of red, green and blue from 0 to 255. */
export function coloursOf(name) {
  return STOPS[name].split(" ").map((stop) => [0, 2, 4].map((at) => parseInt(stop.slice(at, at + 2), 16)));
}

/** The colour at t, from 0 to 1, as CSS has it. */
export function colourAt(colours, t) {
  const at = Math.min(Math.max(t, 0), 1) * (colours.length - 1);
  const lower = Math.min(Math.floor(at), colours.length - 2);
  const mixed = colours[lower].map((x, i) => Math.round(x + (at - lower) * (colours[lower + 1][i] - x)));
  return `rgb(${mixed.join(" ")})`;
}
