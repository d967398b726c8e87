// Open pages in Debian's Chromium and report what happened. Used by the book's and the formgrader's tests.
//
//   node tests/browser/visit.mjs < job.json > report.json
//
// Job:
//   chromium   path of the browser's executable (the caller finds it: shutil.which("chromium"))
//   parallel   pages open at a time, default 2
//   visits     list of
//     url          file:// or http:// address
//     width        CSS pixels, default 1280
//     height       default 900
//     theme        "light" or "dark", default "light": the colour scheme asked for, and the book theme's own choice
//     wait         CSS selector to wait for after loading, default none
//     run          body of an async function run in the page after that, default none; its value is reported
//     axe          true: run axe-core's WCAG 2.1 A and AA rules; a list: only the rules it names; default false
//     screenshot   path of a PNG to write, default none
//     full         true: the screenshot shows the whole page, default false
//     views        list of what to look at one after the other without loading the page again, each with its own of
//                  the fields from `width` to `full` except `wait`; default: one, with the visit's fields
//
// Report: {"visits": [...]}, one for each view, in order, each with
//     url, title
//     requests     every address the page asked for, {url, type, failure}: failure is null, the network error,
//                  or "status 404"
//     console      messages of level error or warning, {type, text}
//     errors       uncaught exceptions of the page, as text
//     math         {containers, errors, raw}: rendered formulas, MathJax error nodes, formulas left as TeX
//     width        {page, window, wider}: scroll and window width in CSS pixels, and up to ten elements that stick out
//     value        what `run` returned
//     axe          violations, {id, impact, help, nodes: [{target, html, summary}]}, or null
//
// The exit status is 0 whenever the visits were made, whatever they found; a browser that does not start is an
// error with exit status 1.
//
// The flags keep Chromium from talking to its maker; the profile is new for each job and removed at the end. As
// root Chromium runs only without its own sandbox, which is why only our own pages are opened.

import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { chromium } from "playwright-core";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"];
const FLAGS = [
  "--headless",
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

// Remember the theme as the book's own switch does, before any script of the page runs.
function rememberTheme(theme) {
  try {
    localStorage.setItem("mode", theme);
    localStorage.setItem("theme", theme);
  } catch {
    // A page without storage has no theme to remember.
  }
}

// Change the theme of a page that is open, as the book's own switch does, and wait until nothing moves any more.
async function changeTheme(theme) {
  Object.assign(document.documentElement.dataset, { mode: theme, theme });
  const drawn = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  await drawn();
  const moving = document.getAnimations().map((animation) => animation.finished);
  await Promise.race([Promise.allSettled(moving), new Promise((done) => setTimeout(done, 1000))]);
  await drawn();
}

// Wait until MathJax, if the page uses it, has rendered everything, then count.
async function inspect() {
  await document.fonts.ready;
  await window.MathJax?.startup?.promise;
  const count = (selector) => document.querySelectorAll(selector).length;
  const raw = [...document.querySelectorAll(".math")].filter((e) => !e.querySelector("mjx-container"));
  const limit = document.documentElement.clientWidth;
  const scrolls = (element) => {
    for (let e = element.parentElement; e && e !== document.body; e = e.parentElement) {
      const style = getComputedStyle(e);
      if (style.overflowX !== "visible" || style.position === "fixed") return true;
    }
    return false;
  };
  const wider = [...document.body.querySelectorAll("*")].filter(
    (e) => e.getBoundingClientRect().right > limit + 1 && !scrolls(e),
  );
  return {
    math: { containers: count("mjx-container"), errors: count("mjx-merror, [data-mjx-error]"), raw: raw.length },
    width: {
      page: document.documentElement.scrollWidth,
      window: limit,
      wider: wider.slice(0, 10).map((e) => e.outerHTML.slice(0, 160)),
    },
  };
}

async function look(page, view) {
  const found = await page.evaluate(inspect);
  let value = null;
  if (view.run) value = await page.evaluate(`(async () => { ${view.run} })()`);
  return { ...found, value };
}

async function runAxe(page, rules) {
  if (!(await page.evaluate(() => Boolean(window.axe)))) await page.addScriptTag({ path: AXE });
  const options = { runOnly: rules === true ? RULES : rules, resultTypes: ["violations"], preload: false };
  const result = await page.evaluate((chosen) => window.axe.run(chosen), options);
  return result.violations.map(({ id, impact, help, nodes }) => ({
    id,
    impact,
    help,
    nodes: nodes.map((n) => ({ target: n.target.join(" "), html: n.html, summary: n.failureSummary })),
  }));
}

async function visit(context, job) {
  const page = await context.newPage();
  const views = job.views ?? [job];
  try {
    const show = async ({ theme, width, height }) => {
      await page.setViewportSize({ width: width ?? 1280, height: height ?? 900 });
      await page.emulateMedia({ colorScheme: theme ?? "light", reducedMotion: "reduce" });
    };
    await show(views[0]);
    await page.addInitScript(rememberTheme, views[0].theme ?? "light");

    const requests = new Map();
    const messages = [];
    const errors = [];
    page.on("request", (r) => requests.set(r, { url: r.url(), type: r.resourceType(), failure: null }));
    page.on("requestfailed", (r) => (requests.get(r).failure = r.failure()?.errorText ?? "failed"));
    page.on("response", (r) => {
      if (r.status() >= 400) requests.get(r.request()).failure = `status ${r.status()}`;
    });
    page.on("console", (m) => {
      if (["error", "warning"].includes(m.type())) messages.push({ type: m.type(), text: m.text() });
    });
    page.on("pageerror", (e) => errors.push(String(e)));

    await page.goto(job.url, { waitUntil: "load", timeout: 60_000 });
    if (job.wait) await page.waitForSelector(job.wait, { timeout: 30_000 });
    const reports = [];
    for (const view of views) {
      if (reports.length) {
        await show(view);
        await page.evaluate(changeTheme, view.theme ?? "light");
      }
      const found = await look(page, view);
      const seen = { requests: [...requests.values()], console: [...messages], errors: [...errors] };
      const axe = view.axe ? await runAxe(page, view.axe) : null;
      if (view.screenshot) await page.screenshot({ path: view.screenshot, fullPage: view.full ?? false });
      reports.push({ url: job.url, title: await page.title(), ...seen, ...found, axe });
    }
    return reports;
  } finally {
    await page.close();
  }
}

const job = JSON.parse(readFileSync(0, "utf8"));
const profile = mkdtempSync(join(tmpdir(), "visit-"));
let context;
try {
  context = await chromium.launchPersistentContext(profile, {
    executablePath: job.chromium,
    headless: true,
    chromiumSandbox: false,
    args: FLAGS,
  });
  const visits = new Array(job.visits.length);
  let next = 0;
  const worker = async () => {
    while (next < visits.length) {
      const i = next++;
      visits[i] = await visit(context, job.visits[i]);
    }
  };
  await Promise.all(Array.from({ length: job.parallel ?? 2 }, worker));
  process.stdout.write(JSON.stringify({ visits: visits.flat() }) + "\n");
} catch (error) {
  console.error(`visit: ${error.message}`);
  process.exitCode = 1;
} finally {
  await context?.close();
  rmSync(profile, { recursive: true, force: true });
}
