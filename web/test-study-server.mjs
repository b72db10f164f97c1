// Tests of a study whose episodes the server simulates, in Chromium: CHAIC names the command, CHROMIUM the browser. They
// need a command with the feature `study-server`.
//
// Promises: a participant plays by keyboard alone; the page holds no episode; a reload in the middle of an episode, a
// lost connection and a restart of the server lose nothing; the export verifies; stopping deletes all data; a helper of
// the researcher acts beside the participant.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { inflateRawSync } from "node:zlib";
import { chaic, findings, launch } from "./test-kit.mjs";
import { dataFiles, end, heading, killServers, playByKeys, serve, skip, tabTo } from "./test-study-kit.mjs";

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

let browser;

before(async () => {
  writeFileSync(join(folder, "text.txt"), "Plain words.\n");
  writeFileSync(definition, STUDY);
  browser = await launch();
});

after(async () => {
  killServers();
  await browser?.close();
  rmSync(folder, { recursive: true });
});

async function open(url) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 } });
  const page = await context.newPage();
  page.on("pageerror", (error) => assert.fail(error.message));
  await page.goto(url);
  await page.locator("chaic-study h1").waitFor();
  return { page, context };
}

const frame = (page) => page.evaluate(() => document.querySelector("chaic-play")?.shown?.frame ?? -1);

/** Returns whether the picture has more than one color. */
const isDrawn = (page) =>
  page.evaluate(() => {
    const canvas = document.querySelector("chaic-play").shadowRoot.querySelector("canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(new Uint32Array(data.buffer)).size > 1;
  });

test("a participant plays by keyboard, reloads in the middle, and the export verifies", { skip }, async () => {
  const data = join(folder, "played");
  let { server, url } = await serve(definition, data);
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
  await playByKeys(page, 60);
  assert.ok(await isDrawn(page));
  assert.deepEqual(await findings(page), []);
  assert.ok(!(await page.locator("chaic-play").innerText()).includes("no_constraint"), "the id would tell the goal");

  // A reload in the middle of the episode.
  const reached = await frame(page);
  await page.reload();
  await heading(page, /^Episode 1 of 2, practice$/);
  await page.getByText("The episode goes on where you were").waitFor();
  await tabTo(page, /^Go on with the episode/);
  await playByKeys(page, reached + 30);

  // A lost connection, and a restart of the server.
  await context.setOffline(true);
  await page.getByText("The episode goes on when it is back").waitFor();
  await context.setOffline(false);
  await page.getByText("The episode goes on when it is back").waitFor({ state: "hidden" });
  await playByKeys(page, reached + 90);
  assert.equal(await end(server), 0);
  await page.getByText("The episode goes on when it is back").waitFor();
  ({ server } = await serve(definition, data, new URL(url).host));
  await page.getByText("The episode goes on when it is back").waitFor({ state: "hidden", timeout: 60_000 });
  await playByKeys(page, reached + 150);
  await tabTo(page, /^Stop here/);
  await page.locator("#continue").waitFor();
  await tabTo(page, /^Continue/);

  await heading(page, /^Episode 2 of 2$/);
  await tabTo(page, /^Start the episode/);
  await playByKeys(page, 60);
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
  const { server, url } = await serve(definition, data);
  const { page, context } = await open(url);
  await page.getByRole("button", { name: "I agree" }).click();
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByRole("button", { name: "Start the episode" }).click();
  await playByKeys(page, 30);
  assert.equal(dataFiles(data).length, 1);
  await page.getByRole("button", { name: "Stop and delete" }).click();
  await page.getByRole("button", { name: "Delete and stop" }).click();
  await page.getByText(/^All your data in this browser and on the server/).waitFor();
  assert.deepEqual(dataFiles(data), []);
  assert.equal(await page.evaluate(async () => (await indexedDB.databases()).length), 0);
  await context.close();
  assert.equal(await end(server), 0);
});

test("a helper of the researcher acts beside the participant", { skip }, async () => {
  const own = join(folder, "own.toml");
  const partner = STUDY.replace('seat = "helper"\nworld = "goes_on"', 'helper = "mine"').replace(/practice.*\n/, "");
  writeFileSync(own, partner);
  const data = join(folder, "own");
  const program = ["--helper", `mine=exec:"${chaic}" helper serve rhp`, "--exec-grants", "ids,goal_place,behavior"];
  const { server, url } = await serve(own, data, undefined, program);
  const { page, context } = await open(url);
  await page.getByRole("button", { name: /^I agree/ }).click();
  await page.getByRole("button", { name: /^Continue/ }).click();
  await page.getByRole("button", { name: /^Start the episode/ }).click();
  await page.locator("chaic-play section").waitFor();
  await playByKeys(page, 150);
  await page.getByRole("button", { name: "Stop here" }).click();
  await page.locator("#continue").waitFor();
  await context.close();
  assert.equal(await end(server), 0);
  const [file] = dataFiles(data);
  const traces = readFileSync(join(data, file), "utf8").split("\n").filter((line) => line.includes('"trace"'));
  const trace = traces.map((line) => JSON.parse(line).text).join("");
  assert.match(trace, /"helper":"mine"/);
  const decisions = trace.split("\n").filter((line) => /^\[\d+,1,/.test(line));
  assert.ok(decisions.length > 3, `${decisions.length} decisions of the helper`);
  execFileSync(chaic, ["study", "export", data, "--study", own, "--out", join(folder, "own-set")]);
});
