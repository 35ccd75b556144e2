// scenarios.js BIN_DIR LAUNCH_DIR CHROMIUM PICTURES: each scenario runs, then the page of `mimesis view` plays its log in a browser
// without a window. Prints a line for each, leaves a picture of each, and ends with 1 if one is not as it has to be.
const { chromium } = require("playwright-core");
const { spawn, spawnSync } = require("child_process");
const fs = require("fs");

const [bin, launch, executablePath, pictures] = process.argv.slice(2);
const scenarios = [
  { file: "imitation", layout: "Imitation", topics: ["planner/robot", "planner/plan", "world/entities", "vision/seen"] },
  { file: "biped", layout: "Biped", topics: ["sim_body/entities", "walker/plan"] },
  { file: "drawer", layout: "Drawer", topics: ["sim_body/entities", "walker/plan"] },
  { file: "crowd", layout: "Crowd", topics: ["crowd/scene"] },
  { file: "walk", layout: "Walk", topics: ["synthesizer/figures"] },
];

/** What is wrong with this scenario's page; nothing if it is as it has to be. */
async function look(browser, { file, layout, topics }) {
  const log = `${pictures}/${file}.mcap`, wrong = [];
  const ran = spawnSync(`${bin}/mimesis`, ["launch", `${launch}/${file}.yaml`, "--name", `page-${file}`, "--arg", `log=${log}`], { encoding: "utf8" });
  if (ran.status !== 0) return [`does not run: ${ran.stdout}${ran.stderr}`];
  const view = spawn(`${bin}/mimesis`, ["view", log, "--port", "0"], { stdio: ["ignore", "pipe", "inherit"] });
  const url = await new Promise((said) => view.stdout.once("data", (text) => said(String(text).trim())));
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  page.on("pageerror", (e) => wrong.push(String(e)));
  page.on("console", (m) => m.type() === "error" && wrong.push(m.text()));
  const begin = Date.now();
  await page.goto(url);
  await page.waitForFunction((l) => document.querySelector("header select")?.value === l, layout).catch(() => wrong.push(`layout is not ${layout}`));
  const interactive = Date.now() - begin;
  const missing = () => page.evaluate((all) => all.filter((t) => ![...mimesisScene.entities.keys()].some((k) => k.startsWith(t))), topics);
  for (let i = 0; i < 150 && (await missing()).length; ++i) await page.waitForTimeout(100);
  for (const topic of await missing()) wrong.push(`${topic} is not drawn`);
  const inPicture = (part) => part > 0.4 && part < 1.1; // it eases, and what moves goes on
  await page.waitForFunction(`(${inPicture})(mimesisScene.filled())`, undefined, { timeout: 20000 }).catch(async () =>
    wrong.push(`the picture cuts off or is empty: ${await page.evaluate(() => mimesisScene.filled())}`));
  const rates = [];
  for (let i = 0; i < 6; ++i) await page.waitForTimeout(500), rates.push(await page.evaluate(() => mimesisScene.rate));
  await page.screenshot({ path: `${pictures}/${file}.png` });
  // A tick of the time line leads to its line of the log.
  const ticks = page.locator(".player .line rect"), count = await ticks.count();
  if (count === 0) wrong.push("no ticks on the time line");
  else {
    const said = Number.parseFloat(await ticks.last().locator("title").textContent());
    await page.getByRole("button", { name: "Pause" }).click().catch(() => {});
    await ticks.last().dispatchEvent("click");
    const there = (s) => Math.abs(Number(document.querySelector(".player input").value) - s) < 0.02;
    await page.waitForFunction(there, said, { timeout: 5000 }).catch(() => wrong.push(`a click on the tick at ${said} s does not go there`));
  }
  await page.getByRole("tab", { name: "Plots" }).click();
  if (await page.locator(".plot").count())
    await page.waitForFunction(() => document.querySelector(".plot")?.dataset.whole === "true").catch(() => wrong.push("the log is not plotted"));
  await page.getByRole("tab", { name: "Why" }).click();
  if (file === "imitation") await page.locator(".why .decision").first().waitFor({ timeout: 20000 }).catch(() => wrong.push("no decision is told"));
  await page.close();
  view.kill("SIGINT");
  console.log(`${file}: ${wrong.length ? "WRONG" : "as it has to be"}; interactive after ${interactive} ms; ` +
    `${rates.sort((a, b) => a - b)[3].toFixed(0)} pictures/s; ${count} ticks; ${pictures}/${file}.png`);
  return wrong;
}

(async () => {
  fs.mkdirSync(pictures, { recursive: true });
  const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-dev-shm-usage"] });
  let failed = false;
  for (const scenario of scenarios)
    for (const line of await look(browser, scenario)) (failed = true), console.log(`${scenario.file}: ${line}`);
  await browser.close();
  process.exit(failed ? 1 : 0);
})();
