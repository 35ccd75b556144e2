// foxglove.RawImage as pixels.
const clamp = (v: number) => (v < 0 ? 0 : v > 255 ? 255 : v);

/** RGBA of an image; undefined: its encoding or size is not known here. */
export function pixels(image: any): ImageData | undefined {
  const { width, height, step, encoding, data } = image;
  if (!width || !height || width * height > 1 << 26) return undefined;
  const bytes: Record<string, number> = { rgb8: 3, bgr8: 3, "8UC3": 3, mono8: 1, "8UC1": 1, rgba8: 4, bgra8: 4, yuv422_yuy2: 2, yuyv: 2 };
  const size = bytes[encoding];
  if (!size || step < size * width || data.length < step * height) return undefined;
  const out = new Uint8ClampedArray(4 * width * height).fill(255);
  const [red, blue] = encoding.startsWith("rgb") ? [0, 2] : [2, 0];
  for (let y = 0; y < height; ++y) {
    let from = y * step, to = 4 * y * width;
    if (size === 2) {
      for (let x = 0; x < width; x += 2, from += 4) {
        const u = data[from + 1] - 128, v = data[from + 3] - 128;
        for (const luma of [data[from], data[from + 2]]) {
          out[to++] = clamp(luma + 1.402 * v);
          out[to++] = clamp(luma - 0.344 * u - 0.714 * v);
          out[to++] = clamp(luma + 1.772 * u);
          ++to;
        }
      }
      continue;
    }
    for (let x = 0; x < width; ++x, from += size, to += 4) {
      out[to] = data[size === 1 ? from : from + red];
      out[to + 1] = data[size === 1 ? from : from + 1];
      out[to + 2] = data[size === 1 ? from : from + blue];
    }
  }
  return new ImageData(out, width, height);
}

type Box = { x: number; y: number; w: number; h: number };
const meet = (a: Box, b: Box) => a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h;
/** The height at which a text is nearest to where it should be and overprints no other: it is taken then. */
export function free(taken: Box[], box: Box): number {
  const hits = (y: number) => taken.some((t) => meet(t, { ...box, y }));
  const ys = [box.y, ...taken.flatMap((t) => [t.y + t.h, t.y - box.h])].filter((y) => !hits(y) && (y >= 0 || y === box.y));
  const y = ys.reduce((best, y) => (Math.abs(y - box.y) < Math.abs(best - box.y) ? y : best), ys[0] ?? box.y);
  taken.push({ ...box, y });
  return y;
}

/** Circles, lines and texts over an image; `taken`: where texts stand already. */
export function annotate(pen: CanvasRenderingContext2D, annotations: any, taken: Box[] = []) {
  const css = (c: any, otherwise = "transparent") => (c && c.a > 0 ? `rgb(${255 * c.r} ${255 * c.g} ${255 * c.b} / ${c.a})` : otherwise);
  for (const circle of annotations.circles) {
    pen.beginPath();
    pen.arc(circle.position?.x ?? 0, circle.position?.y ?? 0, circle.diameter / 2, 0, 2 * Math.PI);
    finish(css(circle.fillColor), css(circle.outlineColor), circle.thickness);
  }
  for (const points of annotations.points) {
    const all = points.points, pairs = points.type === 4;
    pen.beginPath();
    all.forEach((p: any, i: number) => {
      if (points.type === 1) pen.rect(p.x - 1, p.y - 1, 2, 2);
      else if (i === 0 || (pairs && i % 2 === 0)) pen.moveTo(p.x, p.y);
      else pen.lineTo(p.x, p.y);
    });
    if (points.type === 2) pen.closePath();
    finish(css(points.fillColor), css(points.outlineColor, css(points.outlineColors[0])), points.thickness);
  }
  for (const text of annotations.texts) {
    const size = text.fontSize || 12, at = text.position ?? { x: 0, y: 0 };
    pen.font = `${size}px sans-serif`;
    const width = pen.measureText(text.text).width;
    const y = free(taken, { x: at.x, y: at.y - size, w: width, h: 1.2 * size }) + size;
    pen.fillStyle = css(text.backgroundColor);
    pen.fillRect(at.x, y - size, width, 1.2 * size);
    pen.lineWidth = 3;
    pen.strokeStyle = "#000a"; // readable on any picture
    if (!(text.backgroundColor?.a > 0)) pen.strokeText(text.text, at.x, y);
    pen.fillStyle = css(text.textColor, "white");
    pen.fillText(text.text, at.x, y);
  }
  function finish(fill: string, stroke: string, thickness: number) {
    pen.fillStyle = fill;
    pen.strokeStyle = stroke;
    pen.lineWidth = thickness || 1;
    pen.fill();
    pen.stroke();
  }
}
