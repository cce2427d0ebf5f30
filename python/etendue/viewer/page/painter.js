// The picture, by the graphics processor: WebGL 2, with targets of 32-bit floats where there are any, else of 16 bits.

import { turned } from "./chart.js";
import { lattice } from "./field.js";
import { plus } from "./view.js";

const SHAPES = { rectangle: 0, disk: 1, hemisphere: 2, tube: 3 };

const SAMPLES = 16; // points of a pixel of a picture at rest
const COLUMNS = 8; // of the texture of parts
const SLOW = 40; // ms between two frames in motion, above which the picture becomes coarser
const FAST = 22; // ms below which it becomes finer again
const COARSEST = 8;

function compiled(gl, kind, text) {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
  return shader;
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  gl.attachShader(made, compiled(gl, gl.VERTEX_SHADER, vertex));
  gl.attachShader(made, compiled(gl, gl.FRAGMENT_SHADER, fragment));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const places = new Map();
  const place = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(made, name));
    return places.get(name);
  };
  return { made, place };
}

function texture(gl, internal, width, height, format, type, data) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, height, 0, format, type, data);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  return made;
}

/** All tables of a field in one texture, two numbers a cell; each begins a row. */
function tablesOf(field, width) {
  const tables = [];
  let rows = 0;
  const put = (values, errors, relative) => {
    const count = values.codes.length;
    tables.push({ values, errors, relative, row: rows, count });
    const row = rows;
    rows += Math.ceil(count / width);
    return row;
  };
  const layout = field.parts.map((part) => ({
    ratio: put(part.ratio, part.deviation, true),
    ...pair(put, "space", part.space, part.spaceError),
    ...pair(put, "direction", part.direction, part.directionError),
  }));
  const cells = new Float32Array(2 * width * rows);
  for (const { values, errors, relative, row, count } of tables) {
    const start = 2 * row * width;
    const [side] = values.shape;
    const [errorSide] = errors.shape;
    const same = values.codes.length === errors.codes.length;
    for (let i = 0; i < count; i++) {
      const value = values.values[values.codes[i]];
      // Errors on a coarser grid: those of the cell that the centre lies in.
      const j = same ? i : cellOf(Math.floor(i / side), side, errorSide) * errorSide + cellOf(i % side, side, errorSide);
      const error = errors.values[errors.codes[j]];
      cells[start + 2 * i] = value;
      cells[start + 2 * i + 1] = relative ? error * (value || 1) : error;
    }
  }
  return { cells, rows, layout };
}

function cellOf(index, side, other) {
  return Math.min(Math.floor(((index + 0.5) / side) * other), other - 1);
}

function pair(put, name, values, errors) {
  return { [name]: put(values, errors, false), [`${name}Side`]: values.shape[0] };
}

export class Painter {
  /** `subject`: a Field or a PixelMap; `shaders`: the texts of the GLSL files by name. */
  constructor(canvas, subject, shaders, reference) {
    this.canvas = canvas;
    this.reference = reference;
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("This browser has no WebGL 2, by which the picture is drawn. Readings work without it.");
    this.gl = gl;
    // Without this extension no float texture can be drawn into; with the other one 16 bits can.
    this.float = gl.getExtension("EXT_color_buffer_float") !== null;
    if (!this.float) gl.getExtension("EXT_color_buffer_half_float");
    this.show = program(gl, shaders["screen.vert"], shaders["show.frag"]);
    this.fieldProgram = program(gl, shaders["screen.vert"], shaders["field.frag"]);
    this.mapProgram = program(gl, shaders["screen.vert"], shaders["map.frag"]);
    this.targets = [];
    this.samples = 0;
    this.coarseness = 1;
    this.points = lattice(SAMPLES);
    this.setSubject(subject);
  }

  setSubject(subject) {
    const { gl } = this;
    if (this.cells) gl.deleteTexture(this.cells);
    this.subject = subject;
    this.samples = 0;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (subject.parts) {
      const width = Math.min(most, 4096);
      const { cells, rows, layout } = tablesOf(subject, width);
      if (rows > most) throw new Error(`This graphics processor holds ${most} rows of cells; the light field has ${rows}.`);
      this.layout = layout;
      this.cells = texture(gl, gl.RG32F, width, rows, gl.RG, gl.FLOAT, cells);
      this.partData = new Float32Array(4 * COLUMNS * subject.parts.length);
      if (this.parts) gl.deleteTexture(this.parts);
      this.parts = texture(gl, gl.RGBA32F, COLUMNS, subject.parts.length, gl.RGBA, gl.FLOAT, this.partData);
    } else {
      const { columns, rows } = subject;
      if (Math.max(columns, rows) > most) throw new Error(`This graphics processor shows ${most} pixels in a row at most.`);
      const cells = new Float32Array(4 * columns * rows);
      for (let i = 0; i < columns * rows; i++) {
        const live = Number.isFinite(subject.values[i]);
        cells[4 * i] = live ? subject.values[i] / this.reference : 0;
        cells[4 * i + 1] = Number.isFinite(subject.errors[i]) ? subject.errors[i] / this.reference : 0;
        cells[4 * i + 2] = live ? 1 : 0;
      }
      this.cells = texture(gl, gl.RGBA32F, columns, rows, gl.RGBA, gl.FLOAT, cells);
    }
  }

  setColours(colours) {
    const { gl } = this;
    if (this.colours) gl.deleteTexture(this.colours);
    const bytes = new Uint8Array(colours.flatMap(([r, g, b]) => [r, g, b, 255]));
    this.colours = texture(gl, gl.RGBA8, colours.length, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }

  /** Two targets of this size: the mean so far is read from one while the next is written into the other. */
  resize(width, height) {
    const { gl } = this;
    if (this.width === width && this.height === height) return;
    [this.width, this.height] = [width, height];
    for (const target of this.targets) {
      gl.deleteTexture(target.texture);
      gl.deleteFramebuffer(target.frame);
    }
    this.targets = [0, 1].map(() => {
      const internal = this.float ? gl.RGBA32F : gl.RGBA16F;
      const made = texture(gl, internal, width, height, gl.RGBA, this.float ? gl.FLOAT : gl.HALF_FLOAT, null);
      const frame = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, made, 0);
      if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) {
        throw new Error("This graphics processor draws into no textures of floats.");
      }
      return { texture: made, frame };
    });
    this.samples = 0;
  }

  /** The view has changed: `moving` lets the picture be coarser. */
  restart(moving) {
    this.samples = 0;
    this.moving = moving;
  }

  /** Adapts the picture in motion to how long its frames take. */
  pace(milliseconds) {
    if (milliseconds > SLOW && this.coarseness < COARSEST) this.coarseness *= 2;
    else if (milliseconds < FAST && this.coarseness > 1) this.coarseness /= 2;
  }

  /** Whether another sample would make the picture better. */
  get unfinished() {
    return this.samples < (this.subject.parts && !this.moving ? SAMPLES : 1);
  }

  /** One more sample of every pixel. */
  sample(view) {
    const { gl } = this;
    const divisor = this.moving && this.subject.parts ? this.coarseness : 1;
    this.resize(Math.max(1, Math.round(this.canvas.width / divisor)), Math.max(1, Math.round(this.canvas.height / divisor)));
    const [from, to] = this.targets;
    gl.bindFramebuffer(gl.FRAMEBUFFER, to.frame);
    gl.viewport(0, 0, this.width, this.height);
    const { made, place } = this.subject.parts ? this.fieldProgram : this.mapProgram;
    gl.useProgram(made);
    if (this.subject.parts) this.setParts(view);
    this.bind(0, this.cells, place("cells"));
    gl.uniform2f(place("size"), this.width, this.height);
    gl.uniform2f(place("extent"), view.width, view.height);
    if (this.subject.parts) {
      this.bind(1, this.parts, place("parts"));
      this.bind(2, from.texture, place("before"));
      gl.uniform1i(place("partCount"), this.subject.parts.length);
      gl.uniform1f(place("samples"), this.samples);
      const [x, y] = this.moving ? [0.5, 0.5] : this.points[this.samples % SAMPLES];
      gl.uniform2f(place("jitter"), x - 0.5, 0.5 - y);
    } else {
      gl.uniform2f(place("shift"), ...this.subject.shift(view));
      gl.uniform2f(place("whole"), this.subject.width, this.subject.height);
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    this.targets = [to, from];
    this.samples += 1;
  }

  /** The view in the axes of each part. */
  setParts(view) {
    const { gl } = this;
    this.subject.parts.forEach((part, i) => {
      const { chart } = part;
      const rows = this.layout[i];
      const local = (v) => turned(chart.axes, v);
      const [width, height] = chart.size;
      this.partData.set(
        [
          ...local(plus(view.target, chart.centre, -1)), SHAPES[chart.shape],
          ...local(view.right), width,
          ...local(view.up), height,
          ...local(view.toward.map((x) => x * view.distance)), part.level / this.reference,
          ...chart.focus,
          ...part.ratio.shape,
          rows.ratio, rows.space, rows.direction, chart.beam[2],
          rows.spaceSide, rows.directionSide, chart.beam[0], chart.beam[1],
        ],
        4 * COLUMNS * i,
      );
    });
    gl.bindTexture(gl.TEXTURE_2D, this.parts);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, COLUMNS, this.subject.parts.length, gl.RGBA, gl.FLOAT, this.partData);
  }

  /** Onto the canvas, in colours. `look`: range in units of the subject, logarithmic, errors, isolines, grid. */
  paint(look) {
    const { gl } = this;
    const { made, place } = this.show;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.useProgram(made);
    this.bind(0, this.targets[0].texture, place("light"));
    this.bind(1, this.colours, place("colours"));
    gl.uniform2f(place("size"), this.canvas.width, this.canvas.height);
    const unit = look.errors ? 1 : this.reference;
    gl.uniform2f(place("range"), look.range[0] / unit, look.range[1] / unit);
    gl.uniform1i(place("logarithmic"), look.logarithmic ? 1 : 0);
    gl.uniform1i(place("errors"), look.errors ? 1 : 0);
    gl.uniform1f(place("isolines"), look.isolines);
    gl.uniform1i(place("grid"), look.grid ? 1 : 0);
    gl.uniform1i(place("sparse"), this.subject.parts ? 0 : 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** What the processor found at a pixel of the canvas, from its lower left corner; for the tests. */
  found(x, y) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.targets[0].frame);
    const pixel = new Float32Array(4);
    gl.readPixels(x, y, 1, 1, gl.RGBA, gl.FLOAT, pixel);
    return { value: pixel[0] * this.reference, error: pixel[1] * this.reference };
  }

  bind(unit, what, place) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, what);
    gl.uniform1i(place, unit);
  }
}
