// Tests of the pages in Chromium: CHAIC names the command, CHROMIUM the browser.
//
// Promises: a page verifies its traces and uses no network; a frame looks the same however it is
// reached; an altered trace is shown up to the frame that differs; everything works by keyboard; there
// are no findings of axe at any width or color scheme.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { chromium } from "playwright-core";

const chaic = process.env.CHAIC ?? "chaic";
const executablePath = process.env.CHROMIUM ?? "/usr/bin/chromium";
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const folder = mkdtempSync(join(tmpdir(), "chaic-web-"));
const run = join(folder, "run");
const view = join(folder, "view.html");

let browser;

before(async () => {
  const episodes = ["--task", "low_target", "--n-episodes", "1", "--helper", "none,infer"];
  execFileSync(chaic, ["eval", "-q", ...episodes, "--size", "128", "--out", run]);
  execFileSync(chaic, ["view", run, "--out", view]);
  browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true });
});

async function open(file, hash = "", options = {}) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 }, ...options });
  const requests = [];
  page.on("request", (request) => requests.push(request.url()));
  page.on("pageerror", (error) => assert.fail(error.message));
  await page.goto(`file://${file}${hash}`);
  return { page, requests };
}

const shown = (page) =>
  page.waitForFunction(() =>
    document.querySelector("chaic-replay").shadowRoot.querySelector("figcaption b"),
  );

/** Waits until a frame is drawn, and returns a digest of the pixels of all canvases. */
async function pictures(page, frame) {
  // The page draws again if its width changes, as when a scroll bar appears.
  await page.evaluate(async (wanted) => {
    const replay = document.querySelector("chaic-replay");
    for (let n = 0; n < 5; ) {
      n = replay.shown?.frame === wanted && !replay.player.isDrawing ? n + 1 : 0;
      await new Promise(requestAnimationFrame);
    }
  }, frame);
  const urls = await page.evaluate(() =>
    [...document.querySelector("chaic-replay").shadowRoot.querySelectorAll("canvas")].map((canvas) =>
      canvas.toDataURL(),
    ),
  );
  return createHash("sha256").update(urls.join()).digest("hex");
}

test("a page verifies its traces and uses no network", async () => {
  const { page, requests } = await open(view);
  await shown(page);
  const badge = await page.locator("chaic-replay .badge").innerText();
  const [, verified, all] = /^verified: (\d+) of (\d+)/.exec(badge) ?? [];
  assert.ok(Number(all) > 50 && verified === all, badge);
  for (const url of requests) assert.match(url, /^(file|blob|data):/);
  const options = await page.locator("option").allInnerTexts();
  assert.ok(options.some((text) => text.includes("infer")), options.join());
  await page.close();
});

test("a frame looks the same however it is reached, and the address names it", async () => {
  const { page } = await open(view, "#0@340");
  await shown(page);
  const expected = await pictures(page, 340);
  const slider = page.locator("chaic-replay input[type=range]");
  for (const path of [["End"], ["Home"]]) {
    await page.locator("chaic-replay .story button").first().focus();
    for (const key of path) await page.keyboard.press(key);
    await page.evaluate(() => document.querySelector("chaic-replay").seek(337));
    await pictures(page, 337);
    for (let k = 0; k < 3; k++) await page.keyboard.press("ArrowRight");
    assert.equal(await pictures(page, 340), expected);
  }
  await slider.focus();
  await page.keyboard.press("ArrowRight");
  await pictures(page, 341);
  await page.waitForFunction(() => location.hash.endsWith("@341"));
  await page.keyboard.press("Home");
  assert.notEqual(await pictures(page, 0), expected);
  await page.close();
});

test("a replay plays, pauses and moves to events by keyboard", async () => {
  const { page } = await open(view);
  await shown(page);
  const frame = () => page.evaluate(() => document.querySelector("chaic-replay").frame);
  await page.locator("chaic-replay select").first().focus();
  await page.locator("chaic-replay .controls button").nth(2).focus();
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector("chaic-replay").frame > 5);
  await page.keyboard.press("Enter");
  const paused = await frame();
  await page.waitForTimeout(300);
  assert.equal(await frame(), paused);
  await page.keyboard.press("]");
  const event = await frame();
  assert.ok(event > paused, `${event} after ${paused}`);
  assert.equal(await page.locator("chaic-replay [aria-current=step]").count(), 1);
  await page.close();
});

test("an altered trace is shown up to the frame that differs", async () => {
  const trace = join(run, "traces/low_target/none/test-00-s0.jsonl");
  const original = readFileSync(trace, "utf8");
  const lines = original.split("\n");
  const at = lines.findIndex((line, k) => k > 100 && line.includes('"turn_left"'));
  lines[at] = lines[at].replace("turn_left", "turn_right");
  writeFileSync(trace, lines.join("\n"));
  const altered = join(folder, "altered.html");
  execFileSync(chaic, ["view", run, "--helper", "none", "--out", altered]);
  writeFileSync(trace, original);
  const { page } = await open(altered);
  await shown(page);
  assert.match(await page.locator("chaic-replay .badge").innerText(), /^not verified/);
  const problem = await page.locator("chaic-replay [role=alert]").innerText();
  assert.match(problem, /Shown up to frame \d+ of \d+/);
  await page.close();
});

test("a damaged page says what is wrong", async () => {
  const text = readFileSync(view, "utf8");
  const start = text.indexOf('class="chaic-replay">') + 'class="chaic-replay">'.length;
  const damaged = join(folder, "damaged.html");
  writeFileSync(damaged, `${text.slice(0, start)}AAAA${text.slice(start + 4)}`);
  const { page } = await open(damaged);
  const status = page.locator("[data-status]");
  await page.waitForFunction(() => document.querySelector("[data-status]").textContent);
  assert.match(await status.innerText(), /^Cannot show the replays/);
  await page.close();
});

test("axe finds nothing, and nothing is wider than the page", async () => {
  for (const options of [
    { viewport: { width: 1280, height: 900 } },
    { viewport: { width: 360, height: 740 } },
    { viewport: { width: 1280, height: 900 }, colorScheme: "dark" },
    { viewport: { width: 360, height: 740 }, forcedColors: "active" },
  ]) {
    const { page } = await open(view, "#1@900", options);
    await shown(page);
    await page.evaluate(axe);
    const { violations } = await page.evaluate(() => window.axe.run());
    const found = violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.html).join(" ")}`);
    assert.deepEqual(found, [], JSON.stringify(options));
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= options.viewport.width, `${width} in ${JSON.stringify(options)}`);
    await page.close();
  }
});
