// Tests of the pages in Chromium or Firefox: CHAIC names the command, CHROMIUM or FIREFOX the browser.
//
// Promises: a page verifies its traces and uses no network; a frame looks the same however it is
// reached; an altered trace is shown up to the frame that differs; everything works by keyboard; a report
// has the scores of its run and opens its examples; layers of the map show what both agents know; a
// comparison shows where two runs diverge; a person or another helper goes on from a frame; prompts and
// answers are shown; there are no findings of axe at any width or color scheme.

import assert from "node:assert/strict";
import { execFile, execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { once } from "node:events";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { promisify } from "node:util";
import { deflateRawSync, inflateRawSync } from "node:zlib";
import { chaic, findings, firefox, launch, playTo, scrollWidth } from "./test-kit.mjs";

const folder = mkdtempSync(join(tmpdir(), "chaic-web-"));
const run = join(folder, "run");
const view = join(folder, "view.html");
const report = join(run, "report.html");

let browser;

before(async () => {
  const episodes = ["--task", "low_target", "--n-episodes", "1", "--helper", "none,infer"];
  execFileSync(chaic, ["eval", "-q", ...episodes, "--size", "128", "--out", run]);
  execFileSync(chaic, ["view", run, "--out", view]);
  browser = await launch();
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

/** Waits until a replay is verified and a frame of it is drawn. */
const shown = (page) =>
  page.waitForFunction(() => {
    const content = document.querySelector("#player > *")?.shadowRoot;
    return content?.querySelector("figcaption b") && content.querySelector(".controls");
  });

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

test("an address of a missing replay shows the first one", async () => {
  for (const hash of ["#99@340", "#0+99@340"]) {
    const { page } = await open(view, hash);
    await shown(page);
    assert.equal(await page.locator("select").first().inputValue(), "0");
    await page.close();
  }
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
  // Many layouts have brackets on the third level.
  await page.evaluate(() => {
    const section = document.querySelector("chaic-replay").shadowRoot.querySelector("section");
    section.dispatchEvent(new KeyboardEvent("keydown", { key: "]", ctrlKey: true, altKey: true }));
  });
  assert.ok((await frame()) > event);
  await page.close();
});

/** Waits until both agents have run again and the layers of the shown frame are drawn. */
const layersDrawn = (page) =>
  page.waitForFunction(
    () => {
      const { layers, player } = document.querySelector("chaic-replay");
      return layers.rerun?.is_complete && layers.data.memories.length === layers.memories.length && !player.isDrawing;
    },
    undefined,
    { timeout: 60_000 },
  );

/** Returns the color at a point of the canvas with the layers, given in parts of its size. */
const layerColor = (page, x, y) =>
  page.evaluate(
    ([x, y]) => {
      const canvas = document.querySelector("chaic-replay").shadowRoot.querySelector("canvas.layers");
      const [column, row] = [Math.floor(x * canvas.width), Math.floor(y * canvas.height)];
      return [...canvas.getContext("2d").getImageData(column, row, 1, 1).data];
    },
    [x, y],
  );

test("layers of the map show what both agents know, by keyboard and in words", async () => {
  const { page } = await open(view, "#0@900", { viewport: { width: 320, height: 740 } });
  await shown(page);
  const toggle = async (name) => {
    await page.getByLabel(name).focus();
    await page.keyboard.press("Space");
  };
  const words = () => page.locator("chaic-replay .words").innerText();
  await toggle("What the partner knows");
  await toggle("What the helper believes");
  await toggle("Limits of the partner");
  await layersDrawn(page);
  const text = await words();
  for (const name of ["partner", "helper"]) {
    assert.match(text, new RegExp(`The ${name} runs again, and \\d+ of its actions equal the recorded ones\\.`));
    assert.match(text, new RegExp(`The ${name}, at its decision in frame \\d+: has seen [1-9]\\d* m²`));
  }
  assert.match(text, /Its belief equals the recorded one/);
  assert.match(text, /the partner \(.+\) reaches tops from 0\.25 to 1\.50 m/);
  const chart = page.locator("chaic-replay svg.limits");
  const beyond = await page.locator("chaic-replay .words li").count();
  assert.equal(await chart.locator("text.beyond").count(), beyond);
  assert.ok((await chart.locator("circle").count()) > 0, "objects within the limits");
  assert.ok((await chart.locator(".region").boundingBox()).height > 20);
  assert.deepEqual(await findings(page), []);
  assert.ok((await scrollWidth(page)) <= 320);
  assert.equal((await layerColor(page, 0.5, 0.99))[3], 0, "the legend is free");
  await toggle("Truth");
  await layersDrawn(page);
  await page.waitForTimeout(200);
  assert.equal((await layerColor(page, 0.5, 0.99))[3], 255, "the truth is hidden");
  await page.evaluate(() => document.querySelector("chaic-replay").seek(30));
  await page.waitForFunction(() => document.querySelector("chaic-replay").shown.frame === 30);
  const area = (text) => Number(/has seen (\d+) m²/.exec(text)[1]);
  assert.ok(area(await words()) < area(text), "less is known at an earlier frame");
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
  const comparison = join(folder, "altered-comparison.html");
  execFileSync(chaic, ["view", run, "low_target/test/00", "--out", comparison]);
  writeFileSync(trace, original);
  const { page } = await open(altered);
  await shown(page);
  assert.match(await page.locator("chaic-replay .badge").innerText(), /^not verified/);
  const problem = await page.locator("chaic-replay [role=alert]").innerText();
  assert.match(problem, /Shown up to frame \d+ of \d+/);
  await page.close();
  const compared = await open(comparison, "#0+1@0");
  await shown(compared.page);
  const alerts = await compared.page.locator("chaic-compare [role=alert]").allInnerTexts();
  assert.equal(alerts.length, 1, "one of both traces is altered");
  assert.match(alerts[0], /Shown up to frame \d+ of \d+/);
  await compared.page.close();
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
  await page.locator("#choice").selectOption("1");
  await shown(page);
  assert.equal(await status.innerText(), "");
  await page.close();
});

test("a report has the scores of its run, sorts them and opens its examples", async () => {
  const { page, requests } = await open(report);
  await shown(page);
  assert.match(await page.locator(".lead").innerText(), /^With .+ of the goal is delivered; without helper/);
  const link = await page.locator("a[download='scores.json']").getAttribute("href");
  const { tasks } = JSON.parse(Buffer.from(link.split(",")[1], "base64").toString());
  const [task] = Object.values(tasks);
  const rates = () => page.locator("table.sortable").first().locator("tbody tr td.number:nth-child(3)").allInnerTexts();
  const ascending = (a, b) => a - b;
  const expected = Object.values(task).map((score) => score.tr).sort(ascending);
  const shownRates = (await rates()).map(Number);
  shownRates.toSorted(ascending).forEach((rate, k) => assert.ok(Math.abs(rate - expected[k]) < 0.0051, `${rate}`));
  const head = page.getByRole("button", { name: "TR", exact: true });
  await head.focus();
  for (const order of ["ascending", "descending"]) {
    await page.keyboard.press("Enter");
    assert.equal(await page.locator("th[aria-sort]").getAttribute("aria-sort"), order);
    const sorted = shownRates.toSorted((a, b) => (order === "ascending" ? a - b : b - a));
    assert.deepEqual((await rates()).map(Number), sorted);
  }
  const example = page.locator(".examples a").first();
  const [, frame] = /@(\d+)$/.exec(await example.getAttribute("href"));
  await example.click();
  await page.waitForFunction(
    (wanted) => document.querySelector("chaic-replay")?.shown?.frame === wanted,
    Number(frame),
  );
  for (const url of requests) assert.match(url, /^(file|blob|data):/);
  await page.close();
});

test("a comparison shows both runs, and where they diverge", async () => {
  const { page } = await open(report);
  await page.locator(".examples a").nth(1).click();
  await shown(page);
  await page.waitForFunction(() => document.querySelector("chaic-compare")?.shown.filter(Boolean).length === 2);
  const badges = await page.locator("chaic-compare .badge").allInnerTexts();
  assert.equal(badges.filter((text) => text.startsWith("verified")).length, 2, badges.join());
  await page.locator("chaic-compare .link").click();
  const text = await page.locator("chaic-compare header").innerText();
  const [, time] = /First different decision:\s+\d+:\d+\s[^]*?\(frame (\d+)\)/.exec(text);
  const frame = await page.evaluate(() => document.querySelector("chaic-compare").frame);
  assert.ok(frame <= Number(time) && frame > 0, `${frame} ${time}`);
  const partnerActions = (at) =>
    page.evaluate(async (wanted) => {
      const compare = document.querySelector("chaic-compare");
      compare.seek(wanted);
      for (let n = 0; n < 5; ) {
        const isDrawn = compare.shown.every((state) => state.frame === wanted);
        n = isDrawn && !compare.players.some((player) => player.isDrawing) ? n + 1 : 0;
        await new Promise(requestAnimationFrame);
      }
      return compare.shown.map((state) => state.captions[0].action);
    }, at);
  const [a, b] = await partnerActions(frame);
  assert.equal(a, b, "the partner does the same up to the first different decision");
  await page.locator("#other").selectOption("");
  await page.waitForFunction(() => document.querySelector("chaic-replay")?.shown);
  await page.close();
});

/** Downloads the offered trace and verifies it on the command line. */
async function verified(page, name) {
  const link = page.getByRole("link", { name: "Download the trace" });
  const file = join(folder, name);
  if (firefox) {
    // This protocol has no event for downloads.
    const url = await link.evaluate((element) => element.href);
    writeFileSync(file, await page.evaluate((from) => fetch(from).then((response) => response.text()), url));
  } else {
    const [download] = await Promise.all([page.waitForEvent("download"), link.click()]);
    await download.saveAs(file);
  }
  const text = execFileSync(chaic, ["verify", file, "--format", "json"], { encoding: "utf8" });
  assert.equal(JSON.parse(text).passed, true);
  return readFileSync(file, "utf8");
}

test("a game played by keyboard verifies on the command line, and can be watched", async () => {
  const game = join(folder, "play.html");
  execFileSync(chaic, ["play", "low_target/test/00", "--out", game]);
  const { page, requests } = await open(game);
  await page.getByLabel("Speed").selectOption("8");
  await page.getByRole("button", { name: "Start" }).focus();
  await page.keyboard.press("Enter");
  await playTo(page, 150);
  const text = await page.locator("chaic-play header").innerText();
  assert.match(text, /wants something that you do not know/);
  assert.deepEqual(await findings(page), []);
  await page.getByRole("button", { name: "Stop here" }).click();
  await page.getByText("The game has ended.").waitFor();
  assert.equal(await page.locator("chaic-play .plans").count(), 0);
  const trace = await verified(page, "game.jsonl");
  assert.match(trace, /"helper":"human"/);
  await page.getByRole("button", { name: "Watch the replay" }).click();
  await shown(page);
  assert.match(await page.locator("chaic-replay .badge").innerText(), /^verified/);
  for (const url of requests) assert.match(url, /^(file|blob|data):/);
  await page.close();
});

/** Writes a page of one episode that ends at frame `horizon`. */
function shortGame(name, horizon) {
  const file = join(folder, name);
  execFileSync(chaic, ["play", "low_target/test/00", "--out", file]);
  const text = readFileSync(file, "utf8").replace(
    /(class="chaic-episode">)([^<]*)/,
    (_, tag, content) => {
      const episode = JSON.parse(inflateRawSync(Buffer.from(content, "base64")).toString());
      episode.setup.horizon = horizon;
      return tag + deflateRawSync(JSON.stringify(episode)).toString("base64");
    },
  );
  writeFileSync(file, text);
  return file;
}

test("a game of one switch ends with the results of the built-in helpers", async () => {
  const { page } = await open(shortGame("switch.html", 120));
  await page.getByLabel("Speed").selectOption("8");
  await page.getByRole("button", { name: "Start" }).click();
  await page.getByLabel(/for a single switch/).check();
  await page.getByLabel("Time for each choice").selectOption("1");
  const offers = (wanted) =>
    page.waitForFunction(
      (index) => {
        const root = document.querySelector("chaic-play").shadowRoot;
        return [...root.querySelectorAll(".plans button")].indexOf(root.activeElement) === index;
      },
      wanted,
      { timeout: 20_000 },
    );
  for (const index of [1, 0]) await offers(index);
  await page.keyboard.press("Enter");
  await playTo(page, 120);
  await page.waitForFunction(() => {
    const cells = document.querySelector("chaic-play").shadowRoot.querySelectorAll("table .number");
    return cells.length === 4 && [...cells].every((cell) => /^\d+ %$/.test(cell.textContent));
  }, undefined, { timeout: 60_000 });
  await page.close();
});

test("a new turn leaves the focus on other controls of the game", async () => {
  const { page } = await open(shortGame("focus.html", 2000));
  await page.getByLabel("Speed").selectOption("8");
  await page.getByRole("button", { name: "Start" }).click();
  await page.waitForFunction(() => document.querySelector("chaic-play")?.shown?.status === "waiting");
  await page.getByRole("button", { name: "Stop here" }).focus();
  await playTo(page, 200);
  const focused = await page.evaluate(() => document.querySelector("chaic-play").shadowRoot.activeElement?.textContent);
  assert.equal(focused, "Stop here");
  await page.close();
});

test("a game of steps obeys the keys, and its world goes on if it is live", async () => {
  const { page } = await open(shortGame("steps.html", 2000));
  await page.getByLabel("You choose").selectOption("steps");
  await page.getByRole("button", { name: "Start" }).click();
  const state = () => page.evaluate(() => document.querySelector("chaic-play")?.shown);
  await page.waitForFunction(() => document.querySelector("chaic-play")?.shown?.status === "waiting");
  await page.waitForTimeout(300);
  assert.equal((await state()).frame, 0, "the world waits");
  // The start of a game has moved the focus to it.
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction(() => document.querySelector("chaic-play").shown.caption.action === "turns left");
  await page.waitForFunction(() => document.querySelector("chaic-play").shown.status === "waiting");
  // The plan has become impossible between its display and its choice.
  await page.evaluate(() => (document.querySelector("chaic-play").input = { plan: "fly" }));
  await page.getByText("Your last choice was no longer possible").waitFor();
  await page.keyboard.press("ArrowLeft");
  await page.getByText("Your last choice was no longer possible").waitFor({ state: "detached" });
  await page.getByLabel("While you think").selectOption("live");
  await page.getByRole("button", { name: "Start" }).click();
  await page.waitForFunction(() => document.querySelector("chaic-play")?.shown?.frame > 20);
  await page.close();
});

test("a person takes over from a frame of a replay", async () => {
  const { page } = await open(view, "#0@300");
  await shown(page);
  await pictures(page, 300);
  await page.locator("chaic-replay .link", { hasText: "partner" }).click();
  await playTo(page, 400);
  await page.getByRole("button", { name: "Stop here" }).click();
  const trace = await verified(page, "branch.jsonl");
  assert.match(trace, /"partner":"human"/);
  const choice = page.locator("#choice");
  await page.getByRole("button", { name: "Watch the replay" }).click();
  await shown(page);
  assert.equal(await choice.inputValue(), "", "it is no replay of the page");
  assert.equal(await page.evaluate(() => location.hash), "", "the address names no replay");
  await choice.selectOption("0");
  await shown(page);
  assert.equal(await page.evaluate(() => document.querySelector("chaic-replay").frame), 0);
  await page.close();
});

test("another helper goes on from a frame of a replay", async () => {
  const { page: first } = await open(view);
  const index = await first.locator("#choice option", { hasText: "infer" }).getAttribute("value");
  await first.close();
  const { page } = await open(view, `#${index}@300`);
  await shown(page);
  await pictures(page, 300);
  await page.getByLabel("Helper that takes over").selectOption("oracle");
  await page.getByRole("button", { name: "Go on and compare" }).click();
  await page.locator("chaic-compare .chart").waitFor();
  const heading = page.locator("chaic-compare header");
  assert.match(await heading.innerText(), /infer and oracle from 0:10/);
  const difference = /First different decision:[^(]*\(frame (\d+)\)/s.exec(await heading.innerText());
  assert.ok(Number(difference?.[1]) >= 300, String(difference));
  assert.deepEqual(await findings(page), []);
  const trace = await verified(page, "continued.jsonl");
  assert.match(trace, /"helper":"oracle".*"branch_of":\{"trace":"\w+","frame":300\}/);
  await page.getByRole("button", { name: "Watch the replay" }).click();
  await shown(page);
  const text = await page.locator("chaic-replay header").innerText();
  assert.match(text, /It continues another replay from 0:10 on/);
  await page.close();
});

/** Starts a server that answers every question to a language model with the first plan. */
async function startModel() {
  const content = JSON.stringify({ reasoning: "<b>The first</b> plan is good.", plan: 1 });
  const choices = [{ message: { role: "assistant", content }, finish_reason: "stop" }];
  const completion = JSON.stringify({ choices, usage: { prompt_tokens: 800, completion_tokens: 20 } });
  const answer = (request, response) => {
    request.resume().on("end", () => response.setHeader("content-type", "application/json").end(completion));
  };
  const server = createServer(answer).listen(0, "127.0.0.1");
  await once(server, "listening");
  return server;
}

test("a replay of a language helper shows its prompts and answers", async () => {
  const server = await startModel();
  const [out, file] = [join(folder, "language"), join(folder, "language.html")];
  const episode = ["--task", "low_target", "--n-episodes", "1", "--size", "128", "--helper", "llm"];
  const model = ["--endpoint", `http://127.0.0.1:${server.address().port}/v1`, "--model", "first plan"];
  await promisify(execFile)(chaic, ["eval", "-q", ...episode, ...model, "--out", out]);
  server.close();
  execFileSync(chaic, ["view", out, "--out", file]);
  const { page } = await open(file, "#0@400");
  await shown(page);
  const section = page.getByRole("region", { name: "Language model of the helper" });
  const [, first] = /Decision (\d+) of \d+/.exec(await section.innerText()) ?? [];
  await section.getByRole("button", { name: "Next decision" }).click();
  await section.getByText(`Decision ${Number(first) + 1} of`).waitFor();
  assert.ok((await page.evaluate(() => document.querySelector("chaic-replay").frame)) > 400);
  assert.match(await section.locator("summary").allInnerTexts().then(String), /^to the model,answer \(800 \+ 20 tokens/);
  await section.locator("summary").last().click();
  assert.match(await section.locator("pre").last().innerText(), /<b>The first<\/b> plan/);
  assert.deepEqual(await findings(page), []);
  await page.close();
});

test("axe finds nothing, and nothing is wider than the page", async () => {
  for (const options of [
    { viewport: { width: 1280, height: 900 } },
    { viewport: { width: 320, height: 740 } },
    { viewport: { width: 1280, height: 900 }, colorScheme: "dark" },
    { viewport: { width: 320, height: 740 }, reducedMotion: "reduce", forcedColors: "active" },
  ]) {
    for (const [file, hash] of [
      [view, "#1@900"],
      [report, "#1+0@900"],
    ]) {
      const { page } = await open(file, hash, options);
      await shown(page);
      assert.deepEqual(await findings(page), [], JSON.stringify(options));
      const width = await scrollWidth(page);
      assert.ok(width <= options.viewport.width, `${width} in ${JSON.stringify(options)}`);
      await page.close();
    }
  }
});
