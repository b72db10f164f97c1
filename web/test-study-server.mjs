// Tests of a study whose episodes the server simulates, in Chromium: CHAIC names the command, CHROMIUM the browser. They
// need a command with the feature `study-server`.
//
// Promises: a participant plays by keyboard alone; the page holds no episode; a reload in the middle of an episode, a
// lost connection and a restart of the server lose nothing; the export verifies; stopping deletes all data.

import assert from "node:assert/strict";
import { execFileSync, spawn, spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { inflateRawSync } from "node:zlib";
import { chaic, findings, launch } from "./test-kit.mjs";

const folder = mkdtempSync(join(tmpdir(), "chaic-study-server-"));
const definition = join(folder, "study.toml");

const STUDY = `title = "Help without the goal"
consent = "text.txt"
instructions = "text.txt"
debrief = "text.txt"
completion_code = "SHELVES-7"
participants = 8
timeout_minutes = 60
design = "latin_square"
practice = ["no_constraint/train/00"]
episodes = ["low_target/test/00"]

[play]
simulator = "server"
seat = "helper"
world = "goes_on"
speed = 2

[forms]
after_condition = ["trust"]
`;

const probe = spawnSync(chaic, ["study", "serve", "absent.toml", "--data", "absent"], { encoding: "utf8" });
const skip = probe.stderr.includes("no study server") ? "this build of chaic has no study server" : false;

let browser;
const servers = [];

before(async () => {
  writeFileSync(join(folder, "text.txt"), "Plain words.\n");
  writeFileSync(definition, STUDY);
  browser = await launch();
});

after(async () => {
  for (const server of servers) server.kill();
  await browser?.close();
  rmSync(folder, { recursive: true });
});

/** Starts the server and returns its process and address. */
async function serve(data, listen = "127.0.0.1:0") {
  const command = ["study", "serve", definition, "--data", data, "--listen", listen, "--format", "json"];
  const server = spawn(chaic, command, { stdio: ["ignore", "pipe", "inherit"] });
  servers.push(server);
  let printed = "";
  for await (const text of server.stdout) {
    printed += text;
    if (printed.trimEnd().endsWith("}")) break;
  }
  return { server, url: JSON.parse(printed).url };
}

/** Ends a server by Ctrl-C. */
function end(server) {
  return new Promise((resolve) => {
    server.once("exit", (code) => resolve(code));
    server.kill("SIGINT");
  });
}

async function open(url) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 } });
  const page = await context.newPage();
  page.on("pageerror", (error) => assert.fail(error.message));
  await page.goto(url);
  await page.locator("chaic-study h1").waitFor();
  return { page, context };
}

const heading = (page, text) => page.getByRole("heading", { level: 1, name: text }).waitFor();

/** Moves the focus by Tab to an element whose text matches, and presses Enter. */
async function tabTo(page, wanted) {
  for (let n = 0; n < 80; n++) {
    await page.keyboard.press("Tab");
    const name = await page.evaluate(() => {
      let focused = document.activeElement;
      while (focused?.shadowRoot?.activeElement) focused = focused.shadowRoot.activeElement;
      return focused?.textContent.trim() ?? "";
    });
    if (wanted.test(name)) return page.keyboard.press("Enter");
  }
  assert.fail(`no element ${wanted}`);
}

const frame = (page) => page.evaluate(() => document.querySelector("chaic-play")?.shown?.frame ?? -1);

/** Presses the key of the first plan until a frame. */
async function playTo(page, until) {
  for (let n = 0; n < 1200 && (await frame(page)) < until; n++) {
    const status = await page.evaluate(() => document.querySelector("chaic-play")?.shown?.status);
    if (status === "waiting") await page.keyboard.press("1");
    await page.waitForTimeout(50);
  }
  assert.ok((await frame(page)) >= until);
}

/** Returns whether the picture has more than one color. */
const isDrawn = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector("chaic-play").shadowRoot.querySelector("canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(new Uint32Array(data.buffer)).size > 1;
  });

const files = (data) => (existsSync(data) ? readdirSync(data).filter((name) => name.endsWith(".jsonl")) : []);

test("a participant plays by keyboard, reloads in the middle, and the export verifies", { skip }, async () => {
  const data = join(folder, "played");
  let { server, url } = await serve(data);
  const { page, context } = await open(url);
  // The page has neither the module nor an episode.
  const html = await (await page.request.get(url)).text();
  const encoded = /id="chaic-study">([^<]*)/.exec(html)[1];
  const content = JSON.parse(inflateRawSync(Buffer.from(encoded, "base64")).toString());
  assert.deepEqual(content.episodes, []);
  assert.ok(!html.includes('id="chaic-module"') && !html.includes("low_target"));
  await tabTo(page, /^I agree/);
  await heading(page, "Instructions");
  const code = await page.locator("b.code").innerText();
  await tabTo(page, /^Continue/);

  await heading(page, /^Episode 1 of 2, practice$/);
  await tabTo(page, /^Start the episode/);
  await playTo(page, 60);
  assert.ok(await isDrawn(page));
  assert.deepEqual(await findings(page), []);
  assert.ok(!(await page.locator("chaic-play").innerText()).includes("no_constraint"), "the id would tell the goal");

  // A reload in the middle of the episode.
  const reached = await frame(page);
  await page.reload();
  await heading(page, /^Episode 1 of 2, practice$/);
  await page.getByText("The episode goes on where you were").waitFor();
  await tabTo(page, /^Go on with the episode/);
  await playTo(page, reached + 30);

  // A lost connection, and a restart of the server.
  await context.setOffline(true);
  await page.getByText("The episode goes on when it is back").waitFor();
  await context.setOffline(false);
  await page.getByText("The episode goes on when it is back").waitFor({ state: "hidden" });
  await playTo(page, reached + 90);
  assert.equal(await end(server), 0);
  await page.getByText("The episode goes on when it is back").waitFor();
  ({ server } = await serve(data, new URL(url).host));
  await page.getByText("The episode goes on when it is back").waitFor({ state: "hidden", timeout: 60_000 });
  await playTo(page, reached + 150);
  await tabTo(page, /^Stop here/);
  await page.locator("#continue").waitFor();
  await tabTo(page, /^Continue/);

  await heading(page, /^Episode 2 of 2$/);
  await tabTo(page, /^Start the episode/);
  await playTo(page, 60);
  await tabTo(page, /^Stop here/);
  await page.locator("#continue").waitFor();
  await tabTo(page, /^Continue/);
  await heading(page, "Trust");
  await tabTo(page, /^Continue/);
  await tabTo(page, /^Continue/);
  await heading(page, "The end");
  await page.getByText("The server has all your data").waitFor();
  const [download] = await Promise.all([page.waitForEvent("download"), tabTo(page, /^Download/)]);
  const stored = readFileSync(join(data, `${code}.jsonl`), "utf8");
  assert.equal(readFileSync(await download.path(), "utf8"), stored);
  await context.close();
  assert.equal(await end(server), 0);

  const records = stored.trimEnd().split("\n").map((line) => JSON.parse(line));
  const ends = records.filter((record) => record.type === "trial_end");
  assert.deepEqual(ends.map((record) => [record.trial, record.outcome]), [[0, "stopped"], [1, "stopped"]]);
  const out = join(folder, "set");
  const command = ["study", "export", data, "--study", definition, "--out", out, "--format", "json"];
  const report = JSON.parse(execFileSync(chaic, command, { encoding: "utf8" }));
  assert.deepEqual([report.participants, report.completed, report.traces, report.verified], [1, 1, 2, 2]);
  const trace = join(out, "traces", code, "trial-00.jsonl");
  const verified = execFileSync(chaic, ["verify", trace, "--format", "json"], { encoding: "utf8" });
  assert.equal(JSON.parse(verified).passed, true);
  execFileSync(chaic, ["study", "delete", code, data]);
});

test("stopping in an episode deletes all data on the server", { skip }, async () => {
  const data = join(folder, "stopped");
  const { server, url } = await serve(data);
  const { page, context } = await open(url);
  await page.getByRole("button", { name: "I agree" }).click();
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByRole("button", { name: "Start the episode" }).click();
  await playTo(page, 30);
  assert.equal(files(data).length, 1);
  await page.getByRole("button", { name: "Stop and delete" }).click();
  await page.getByRole("button", { name: "Delete and stop" }).click();
  await page.getByText(/^All your data in this browser and on the server/).waitFor();
  assert.deepEqual(files(data), []);
  assert.equal(await page.evaluate(async () => (await indexedDB.databases()).length), 0);
  await context.close();
  assert.equal(await end(server), 0);
});
