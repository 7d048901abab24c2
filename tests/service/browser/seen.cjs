// What is seen on a page: colors of a picture, and the contrast of every text.

/**
 * The colors of an element as it is drawn: how many there are, how many pixels are red, how many have the gray of ground
 * in the shadow (in the light scheme), the middle of those that have the green of the arrow, and a digest of all.
 */
exports.inksOf = async function inksOf(page, element) {
  const png = (await element.screenshot()).toString("base64");
  return page.evaluate(async (png) => {
    const image = new Image();
    image.src = `data:image/png;base64,${png}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    const colors = new Set();
    let [red, shade, digest] = [0, 0, 0];
    const green = { count: 0, x: 0, y: 0 };
    for (let at = 0; at < data.length; at += 4) {
      const [r, g, b] = [data[at], data[at + 1], data[at + 2]];
      colors.add((r << 16) | (g << 8) | b);
      if (r > 120 && r > 2 * g && r > 2 * b && Math.abs(g - b) < 30) red += 1;
      if (r > 165 && r < 195 && Math.abs(r - g) < 6 && Math.abs(g - b) < 8) shade += 1;
      if (g > 60 && g > 2 * r && g > b && b > r) {
        green.count += 1;
        green.x += (at / 4) % canvas.width;
        green.y += Math.floor(at / 4 / canvas.width);
      }
      digest = (Math.imul(digest, 31) + r * 7 + g * 3 + b) | 0;
    }
    [green.x, green.y] = [green.x / green.count, green.y / green.count];
    return { colors: colors.size, red, shade, green, digest };
  }, png);
};

/** The colors of an element once it is drawn the same half a second later, within ten seconds: a busy machine draws late. */
exports.stillInks = async function stillInks(page, element) {
  for (let round = 0; round < 20; round += 1) {
    const before = await exports.inksOf(page, element);
    await page.waitForTimeout(500);
    if ((await exports.inksOf(page, element)).digest === before.digest) return before;
  }
  throw new Error("it does not stand still");
};

/** Texts whose contrast with what lies under them is below that of WCAG 2 AA: 4.5, or 3 for large letters. */
exports.contrasts = function contrasts(page) {
  return page.evaluate(() => {
    const pen = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    const rgba = (color) => {
      pen.clearRect(0, 0, 1, 1);
      pen.fillStyle = color;
      pen.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data;
      return [r, g, b, a / 255];
    };
    const over = ([r, g, b, a], under) => [r, g, b].map((part, at) => part * a + under[at] * (1 - a));
    const ground = (element) => {
      const layers = [];
      for (let one = element; one; one = one.parentElement) {
        const color = rgba(getComputedStyle(one).backgroundColor);
        if (color[3] > 0) layers.push(color);
        if (color[3] === 1) break;
      }
      return layers.reduceRight((under, color) => over(color, under), [255, 255, 255]);
    };
    const light = (color) => {
      const [r, g, b] = color.map((part) => (part <= 10.31 ? part / 3294.6 : ((part / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const poor = [];
    for (const element of document.querySelectorAll("body *")) {
      const own = [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim());
      if (!own || !element.checkVisibility() || element.closest(":disabled, .unseen, .skip, noscript, option")) continue;
      const style = getComputedStyle(element);
      const under = ground(element);
      const drawn = element instanceof SVGElement ? style.fill : style.color;
      const [a, b] = [light(over(rgba(drawn), under)), light(under)].sort((x, y) => y - x);
      const contrast = (a + 0.05) / (b + 0.05);
      const size = parseFloat(style.fontSize);
      const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
      if (contrast < (large ? 3 : 4.5)) poor.push(`${contrast.toFixed(2)}: ${element.textContent.slice(0, 40)}`);
    }
    return [...new Set(poor)];
  });
};
