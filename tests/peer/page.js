// page.js URL CHROMIUM PICTURE: the page of `mimesis view` in a browser without a window, as JSON: times [ms], what axe-core finds on
// each tab in dark, light and on a small screen, and errors of the console.
const { chromium } = require("playwright-core");
const axe = require("fs").readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const [url, executablePath, picture] = process.argv.slice(2);
const looks = [{ colorScheme: "dark" }, { colorScheme: "light" }, { colorScheme: "dark", viewport: { width: 390, height: 780 }, hasTouch: true }];

(async () => {
  const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-dev-shm-usage"] });
  const seen = { violations: [], errors: [], tabs: [], wide: [] };
  for (const look of looks) {
    const page = await (await browser.newContext({ bypassCSP: true, ...look })).newPage();
    page.on("pageerror", (e) => seen.errors.push(String(e)));
    page.on("console", (m) => m.type() === "error" && seen.errors.push(m.text()));
    const begin = Date.now();
    await page.goto(url);
    await page.getByRole("status").filter({ hasText: /^connected$/ }).waitFor();
    await page.waitForFunction(() => document.querySelector("header select").value); // the layout that fits
    await page.keyboard.press("1");
    await page.locator("td summary").first().waitFor(); // a node
    seen.interactive_ms ??= Date.now() - begin;
    seen.layout = await page.getByLabel("Layout").inputValue();
    await page.addScriptTag({ content: axe });
    for (const tab of await page.getByRole("tab").all()) {
      await tab.click();
      seen.tabs.push(await tab.textContent());
      const found = await page.evaluate(() => axe.run());
      for (const v of found.violations) seen.violations.push(`${await tab.textContent()}: ${v.id}: ${v.nodes[0].html}`);
    }
    seen.wide.push(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth));
    if (look === looks[0]) {
      await page.keyboard.press("1");
      await page.waitForFunction(() => mimesisScene.entities.size > 0);
      seen.drawn = await page.evaluate(() => mimesisScene.entities.size);
      await page.screenshot({ path: picture });
    }
    await page.close();
  }
  await browser.close();
  console.log(JSON.stringify(seen));
})().catch((e) => (console.log(JSON.stringify({ failed: String(e) })), process.exit(1)));
