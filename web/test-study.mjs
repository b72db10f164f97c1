// Tests of the page of a study in Chromium: CHAIC names the command, CHROMIUM the browser.
//
// Promises: nothing is stored before the consent; a participation by keyboard alone gives data that
// `chaic study export` verifies; a reload loses nothing and goes on at the checkpoint; stopping deletes all
// data, or says what delays this; a browser that stores no data leads to a message; one switch suffices; axe finds
// nothing, and nothing is wider than the page. With a server, the same holds for its files, also if the network or the
// server fails in between; these tests need a command with the feature
// `study-server`.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { deflateRawSync, inflateRawSync } from "node:zlib";
import { chaic, findings, launch, playTo, scrollWidth } from "./test-kit.mjs";
import { dataFiles, end, heading, killServers, playByKeys, serve, skip, tabTo } from "./test-study-kit.mjs";

const folder = mkdtempSync(join(tmpdir(), "chaic-study-"));
const definition = join(folder, "study.toml");
const file = join(folder, "study.html");

const STUDY = `title = "Help with high shelves"
consent = "consent.txt"
instructions = "instructions.txt"
debrief = "debrief.txt"
completion_code = "SHELVES-7"
participants = 8
timeout_minutes = 60
design = "latin_square"
practice = ["no_constraint/train/00"]
episodes = ["low_target/test/00", "low_target/test/01"]

[play]
speed = 8

[factors]
helper = ["none", "rhp"]

[forms]
after_condition = ["nasa_tlx", "trust"]
at_end = ["sus"]
`;

let browser;

before(async () => {
  for (const name of ["consent", "instructions", "debrief"]) {
    writeFileSync(join(folder, `${name}.txt`), `Plain words of the ${name}.\n\n- one\n- two\n`);
  }
  writeFileSync(definition, STUDY);
  execFileSync(chaic, ["study", "build", definition, "--out", file]);
  browser = await launch();
});

after(async () => {
  killServers();
  await browser?.close();
  rmSync(folder, { recursive: true });
});

/** Opens the page in a browser profile of its own. */
async function open(hash, { path = file, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  page.on("pageerror", (error) => assert.fail(error.message));
  page.on("request", (request) => assert.match(request.url(), /^(file|blob|data):/));
  await page.goto(`file://${path}${hash}`);
  await page.locator("chaic-study h1").waitFor();
  return { page, context };
}

const databases = (page) => page.evaluate(async () => (await indexedDB.databases()).length);
const records = (page) => page.evaluate(() => document.querySelector("chaic-study").log.records);

/** Answers a form by keyboard: the first rating of each item, then one step to the right. */
async function answer(page, n) {
  for (let k = 0; k < n; k++) {
    await tabTo(page, /^\s*\d+, /, "Space");
    await page.keyboard.press("ArrowRight");
  }
  await tabTo(page, /^Continue/);
}

/** Plays and stops the trial that the page offers, by keyboard. */
async function trial(page, text) {
  await heading(page, text);
  await tabTo(page, /^Start the episode/);
  await playByKeys(page, 60);
  await tabTo(page, /^Stop here/);
  await page.locator("#continue").waitFor();
  await tabTo(page, /^Continue/);
}

test("a participation by keyboard alone gives data that verify", async () => {
  const { page, context } = await open("#3");
  assert.equal(await databases(page), 0, "nothing is stored before the consent");
  await tabTo(page, /^I agree/);
  await heading(page, "Instructions");
  assert.equal(await databases(page), 1);
  await tabTo(page, /^Continue/);
  await trial(page, /^Episode 1 of 3, practice$/);
  for (const title of [/^Episode 2 of 3$/, /^Episode 3 of 3$/]) {
    await trial(page, title);
    await heading(page, "Workload");
    await answer(page, 6);
    await heading(page, "Trust");
    await answer(page, 3);
  }
  await heading(page, "Usability");
  // A form without answers warns once.
  await tabTo(page, /^Continue/);
  assert.match(await page.getByRole("alert").innerText(), /10 questions have no answer/);
  await tabTo(page, /^Continue/);
  await heading(page, "The end");
  assert.match(await page.locator("chaic-study").innerText(), /SHELVES-7/);
  const [download] = await Promise.all([page.waitForEvent("download"), tabTo(page, /^Download/)]);
  const data = join(folder, download.suggestedFilename());
  await download.saveAs(data);
  const text = readFileSync(data, "utf8");
  assert.match(download.suggestedFilename(), /^[A-Z2-9]{10}\.jsonl$/);
  const [personal] = /Mozilla|Chrom|Linux|20\d\d-\d\d-\d\d|\d\d:\d\d:\d\d/.exec(text) ?? [];
  assert.equal(personal, undefined, "the data have no browser and no clock time");

  const out = join(folder, "set");
  const command = ["study", "export", data, "--study", definition, "--out", out, "--lerobot", "--format", "json"];
  const report = JSON.parse(execFileSync(chaic, command, { encoding: "utf8" }));
  assert.deepEqual([report.participants, report.completed, report.traces, report.verified], [1, 1, 3, 3]);
  assert.ok(!report.open_slots.includes(3));
  const code = download.suggestedFilename().slice(0, 10);
  const trace = join(out, "traces", code, "trial-01.jsonl");
  const verified = execFileSync(chaic, ["verify", trace, "--format", "json"], { encoding: "utf8" });
  assert.equal(JSON.parse(verified).passed, true);
  const scores = readFileSync(join(out, "data", `study-${digest(text)}_description-scores_data.csv`), "utf8");
  const workload = scores.split("\n").filter((row) => row.includes("nasa_tlx"));
  assert.deepEqual(workload.map((row) => row.split(",").at(-1)), ["5", "5"], "the second rating of each item");
  const lerobot = join(out, "lerobot-partner");
  assert.equal(JSON.parse(readFileSync(join(lerobot, "meta/info.json"), "utf8")).total_episodes, 2, "no practice");
  rmSync(lerobot, { recursive: true });
  execFileSync(chaic, ["study", "delete", code, out]);
  assert.throws(() => readFileSync(trace));
  await context.close();
});

const digest = (text) => JSON.parse(text.split("\n")[0]).study.slice(0, 8);

test("a second click has no effect", async () => {
  const { page, context } = await open("#2");
  const clickTwice = (name) =>
    page.getByRole("button", { name }).evaluate((button) => {
      button.click();
      button.click();
    });
  await clickTwice(/^I agree/);
  await heading(page, "Instructions");
  await clickTwice("Continue");
  await heading(page, /^Episode 1 of 3, practice$/);
  assert.deepEqual((await records(page)).map((record) => record.type), ["start", "instructed"]);
  await context.close();
});

test("a reload loses nothing and goes on at the checkpoint", async () => {
  const { page, context } = await open("#1");
  await page.getByRole("button", { name: "I agree" }).click();
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByRole("button", { name: "Start the episode" }).click();
  await playTo(page, 90);
  const before = await records(page);
  assert.ok(before.filter((record) => record.type === "trace").length > 1, "decisions are saved while playing");
  await page.reload();
  await heading(page, /^Episode 2 of 3$/);
  const kept = await records(page);
  assert.deepEqual(kept.slice(0, before.length), before);
  assert.deepEqual(kept.at(-1), { type: "trial_end", trial: 0, outcome: "left" });
  const second = await context.newPage();
  await second.goto(page.url());
  assert.match(await second.getByRole("alert").innerText(), /open in another tab/);
  await second.close();
  // The trace up to the reload verifies.
  const data = join(folder, "left.jsonl");
  writeFileSync(data, kept.map((record) => `${JSON.stringify(record)}\n`).join(""));
  const out = join(folder, "left");
  const command = ["study", "export", data, "--study", definition, "--out", out, "--format", "json"];
  const report = JSON.parse(execFileSync(chaic, command, { encoding: "utf8" }));
  assert.deepEqual([report.completed, report.traces, report.verified], [0, 1, 1]);
  await page.reload();
  await heading(page, /^Episode 2 of 3$/);
  assert.equal((await records(page)).length, kept.length, "a second reload changes nothing");
  await context.close();
});

test("a reload in the last episode leads to the end and completes the participation", async () => {
  const [own, path] = ["plain.toml", "plain.html"].map((name) => join(folder, name));
  writeFileSync(own, STUDY.replace(/practice.*\n/, "").replace(/\[forms\][^]*/, ""));
  execFileSync(chaic, ["study", "build", own, "--out", path]);
  const { page, context } = await open("#1", { path });
  await page.getByRole("button", { name: "I agree" }).click();
  await page.getByRole("button", { name: "Continue" }).click();
  for (const title of [/^Episode 1 of 2$/, /^Episode 2 of 2$/]) {
    await heading(page, title);
    await page.getByRole("button", { name: "Start the episode" }).click();
    await playTo(page, 20);
    await page.reload();
  }
  await heading(page, "The end");
  const kept = await records(page);
  assert.deepEqual(kept.slice(-2).map((record) => record.type), ["trial_end", "complete"]);
  await page.reload();
  await heading(page, "The end");
  assert.equal((await records(page)).length, kept.length);
  await context.close();
});

test("stopping deletes all data, also in an episode", async () => {
  const { page, context } = await open("#2");
  await page.getByRole("button", { name: "I agree" }).click();
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByRole("button", { name: "Start the episode" }).click();
  await playTo(page, 30);
  await page.getByRole("button", { name: "Stop and delete" }).click();
  await page.getByRole("button", { name: "Go on with the study" }).click();
  await page.getByRole("button", { name: "Stop and delete" }).click();
  await page.getByRole("button", { name: "Delete and stop" }).click();
  await heading(page, "You have stopped");
  await page.waitForFunction(async () => (await indexedDB.databases()).length === 0);
  await page.waitForTimeout(500);
  assert.equal(await databases(page), 0);
  await page.reload();
  await heading(page, "Help with high shelves");
  await context.close();
});

test("a browser that stores no data leads to a message", async () => {
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto(`file://${file}#2`);
  await heading(page, "Help with high shelves");
  await page.evaluate(() => {
    window.open_ = IDBFactory.prototype.open;
    IDBFactory.prototype.open = () => {
      throw new DOMException("denied", "SecurityError");
    };
  });
  await page.getByRole("button", { name: "I agree" }).click();
  await page.getByText("this browser does not store your data (SecurityError: denied)").waitFor();
  await heading(page, "Help with high shelves");
  await page.evaluate(() => {
    IDBFactory.prototype.open = window.open_;
  });
  await page.getByRole("button", { name: "I agree" }).click();
  await heading(page, "Instructions");
  assert.equal(await page.getByRole("alert").count(), 0);
  // Without a record, later ones would leave a gap.
  await page.evaluate(() => {
    window.add_ = IDBObjectStore.prototype.add;
    IDBObjectStore.prototype.add = function (...values) {
      const request = window.add_.apply(this, values);
      this.transaction.abort();
      return request;
    };
  });
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByText("this browser does not store your data").waitFor();
  await page.evaluate(() => {
    IDBObjectStore.prototype.add = window.add_;
  });
  await page.getByRole("button", { name: "Continue" }).click();
  assert.deepEqual((await records(page)).map((record) => record.type), ["start"]);
  await page.reload();
  await heading(page, "Instructions");
  await context.close();
});

test("a deletion says that it waits for another tab", async () => {
  const { page, context } = await open("#2");
  await page.getByRole("button", { name: "I agree" }).click();
  await heading(page, "Instructions");
  const second = await context.newPage();
  await second.goto(page.url());
  // A page of an earlier version keeps its connection.
  await second.evaluate(async () => {
    const [{ name }] = await indexedDB.databases();
    const request = indexedDB.open(name);
    await new Promise((resolve) => (request.onsuccess = resolve));
    window.kept = request.result;
  });
  await page.getByRole("button", { name: "Stop and delete" }).click();
  await page.getByRole("button", { name: "Delete and stop" }).click();
  await page.getByText("This study is open in another tab").waitFor();
  await page.getByText("Your data are being deleted").waitFor();
  await second.close();
  await page.getByText("are deleted. You may close this page").waitFor();
  assert.equal(await databases(page), 0);
  await context.close();
});

/** Returns a page whose episodes end at frame `horizon`. */
function shortStudy(horizon) {
  const path = join(folder, "short.html");
  const text = readFileSync(file, "utf8").replace(/(id="chaic-study">)([^<]*)/, (_, tag, encoded) => {
    const content = JSON.parse(inflateRawSync(Buffer.from(encoded, "base64")).toString());
    content.episodes = content.episodes.map((line) => {
      const episode = JSON.parse(line);
      episode.setup.horizon = horizon;
      return JSON.stringify(episode);
    });
    return tag + deflateRawSync(JSON.stringify(content)).toString("base64");
  });
  writeFileSync(path, text);
  return path;
}

test("one switch suffices from the consent to the first form", async () => {
  const { page, context } = await open("", { path: shortStudy(90) });
  // Without a slot in the address, the page asks for it.
  await page.getByLabel(/participant number/).fill("4");
  await Promise.all([page.waitForEvent("load"), page.keyboard.press("Enter")]);
  await page.getByLabel(/One switch/).check();
  const take = async (name) => {
    await page.waitForFunction(
      (pattern) => {
        let focused = document.activeElement;
        while (focused?.shadowRoot?.activeElement) focused = focused.shadowRoot.activeElement;
        return new RegExp(pattern).test(focused?.getAttribute("aria-label") ?? focused?.textContent.trim());
      },
      name,
      { timeout: 30_000 },
    );
    await page.keyboard.press("Enter");
  };
  await take("^I agree");
  await take("^Continue");
  for (const title of [/^Episode 1 of 3, practice$/, /^Episode 2 of 3$/]) {
    await heading(page, title);
    await take("^Start the episode");
    await page.waitForFunction(() => document.querySelector("chaic-play")?.shown?.status === "waiting");
    await take("^(?!Stop|Continue)\\w");
    await playTo(page, 90);
    await take("^Continue");
  }
  await heading(page, "Workload");
  await take("^0, very low");
  const inputs = page.locator("fieldset").nth(1).locator("input").first();
  await page.waitForFunction((input) => document.activeElement === input, await inputs.elementHandle());
  assert.ok((await records(page)).some((record) => record.type === "trial_end" && record.outcome === "ended"));
  await context.close();
});

test("axe finds nothing, and nothing is wider than the page", async () => {
  for (const options of [
    { viewport: { width: 1280, height: 900 } },
    { viewport: { width: 360, height: 740 }, colorScheme: "dark" },
  ]) {
    const { page, context } = await open("#5", options);
    const check = async (name) => {
      assert.deepEqual(await findings(page), [], `${name} ${JSON.stringify(options)}`);
      const width = await scrollWidth(page);
      assert.ok(width <= options.viewport.width, `${name}: ${width} in ${JSON.stringify(options)}`);
      if (process.env.SCREENSHOTS) {
        const { width } = options.viewport;
        await page.screenshot({ path: join(process.env.SCREENSHOTS, `${width}-${name}.png`), fullPage: true });
      }
    };
    const press = (name) => page.getByRole("button", { name }).click();
    await check("consent");
    await press("I agree");
    await check("instructions");
    await press("Continue");
    for (const k of [1, 2]) {
      await heading(page, new RegExp(`^Episode ${k} of 3`));
      if (k === 1) await check("trial");
      await press("Start the episode");
      await playTo(page, 20);
      if (k === 2) await check("play");
      await press("Stop here");
      await press("Continue");
    }
    await check("form");
    await press("Continue");
    await check("form-warned");
    await press("Continue");
    await heading(page, "Trust");
    await press("Stop and delete");
    await check("question");
    await press("Delete and stop");
    await heading(page, "You have stopped");
    await check("left");
    await context.close();
  }
});

/** Waits until a condition of this process holds. */
async function until(condition) {
  for (let n = 0; n < 600 && !condition(); n++) await new Promise((resolve) => setTimeout(resolve, 50));
  assert.ok(condition(), String(condition));
}

/** Waits until the only file of a folder has all records of the page, and returns them. */
async function uploaded(page, data) {
  const expected = (await records(page)).map((record) => `${JSON.stringify(record)}\n`).join("");
  await until(() => {
    const [name] = dataFiles(data);
    return name !== undefined && readFileSync(join(data, name), "utf8").startsWith(expected);
  });
  return expected;
}

test("a server has every record, whatever fails in between, and deletes them", { skip }, async () => {
  const data = join(folder, "interrupted");
  let { server, url } = await serve(definition, data);
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 } });
  const page = await context.newPage();
  page.on("pageerror", (error) => assert.fail(error.message));
  page.on("request", (request) => assert.ok(/^(blob|data):/.test(request.url()) || request.url().startsWith(url)));
  await page.goto(url);
  await heading(page, "Help with high shelves");
  assert.deepEqual([await databases(page), dataFiles(data).length], [0, 0], "nothing is stored before the consent");
  await page.getByRole("button", { name: "I agree" }).click();
  await heading(page, "Instructions");
  const code = await page.locator("b.code").innerText();
  assert.deepEqual(dataFiles(data), [`${code}.jsonl`]);
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByRole("button", { name: "Start the episode" }).click();
  await playTo(page, 60);
  await uploaded(page, data);

  await context.setOffline(true);
  await playTo(page, 150);
  await page.getByText("There is no connection to the server").waitFor();
  await context.setOffline(false);
  await uploaded(page, data);
  await page.getByText("There is no connection to the server").waitFor({ state: "hidden" });

  assert.equal(await end(server), 0);
  await playTo(page, 240);
  await page.getByText("There is no connection to the server").waitFor();
  ({ server } = await serve(definition, data, new URL(url).host));
  const before = await uploaded(page, data);
  await page.reload();
  await heading(page, /^Episode 2 of 3$/);
  const after = await uploaded(page, data);
  assert.equal(after.slice(0, before.length), before);
  assert.match(after, /"outcome":"left"\}\n$/);

  // The participant stops while the server is away.
  assert.equal(await end(server), 0);
  await page.getByRole("button", { name: "Stop and delete" }).click();
  await page.getByRole("button", { name: "Delete and stop" }).click();
  await page.getByText("The server has not confirmed the deletion yet").waitFor();
  assert.deepEqual(dataFiles(data), [`${code}.jsonl`]);
  // The open page would repeat its request when the server is back. A new page continues it, too.
  await page.goto("about:blank");
  ({ server } = await serve(definition, data, new URL(url).host));
  await page.goto(url);
  await page.getByText(/^All your data in this browser and on the server/).waitFor();
  assert.deepEqual(readdirSync(data).filter((name) => name !== ".lock"), []);
  assert.equal(await databases(page), 0);
  await context.close();
  assert.equal(await end(server), 0);
});

test("a participation with a server gives data that verify", { skip }, async () => {
  const data = join(folder, "served");
  const { server, url } = await serve(definition, data);
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 } });
  const page = await context.newPage();
  page.on("pageerror", (error) => assert.fail(error.message));
  // Violations of the policy, for example.
  page.on("console", (message) => assert.notEqual(message.type(), "error", message.text()));
  await page.goto(url);
  await heading(page, "Help with high shelves");
  await tabTo(page, /^I agree/);
  await heading(page, "Instructions");
  await tabTo(page, /^Continue/);
  await trial(page, /^Episode 1 of 3, practice$/);
  for (const title of [/^Episode 2 of 3$/, /^Episode 3 of 3$/]) {
    await trial(page, title);
    for (const form of ["Workload", "Trust"]) {
      await heading(page, form);
      await tabTo(page, /^Continue/);
      await tabTo(page, /^Continue/);
    }
  }
  await heading(page, "Usability");
  await answer(page, 10);
  await heading(page, "The end");
  await page.getByText("The server has all your data").waitFor();
  assert.deepEqual(await findings(page), []);
  const text = await uploaded(page, data);
  const [download] = await Promise.all([page.waitForEvent("download"), tabTo(page, /^Download/)]);
  assert.equal(readFileSync(await download.path(), "utf8"), text);
  await tabTo(page, /^Remove the copy/);
  await page.getByText("The copy in this browser is removed").waitFor();
  // The page has no token any more, so it must not promise to delete the data on the server.
  assert.ok(await page.getByRole("button", { name: "Stop and delete" }).isDisabled());
  assert.equal(await databases(page), 0);
  await page.reload();
  await heading(page, "Help with high shelves");
  await context.close();
  assert.equal(await end(server), 0);
  const out = join(folder, "served-set");
  const command = ["study", "export", data, "--study", definition, "--out", out, "--format", "json"];
  const report = JSON.parse(execFileSync(chaic, command, { encoding: "utf8" }));
  assert.deepEqual([report.participants, report.completed, report.traces, report.verified], [1, 1, 3, 3]);
});
