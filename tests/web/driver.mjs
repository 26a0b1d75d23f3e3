// SPDX-License-Identifier: Apache-2.0
// Runs scenarios in one headless Chromium. On stdin, a line of JSON for each: {scenario, url, args}; on
// stdout the outcome, {ok, result} or {ok, error}, and before it any number of {call, args}, whose
// answer is the next line of stdin.

import readline from "node:readline";
import {chromium} from "playwright-core";

const lines = readline.createInterface({input: process.stdin})[Symbol.asyncIterator]();
const say = (value) => process.stdout.write(JSON.stringify(value) + "\n");
const hear = async () => JSON.parse((await lines.next()).value);

/** Has the test do something outside of the browser. */
async function call(name, args) {
    say({call: name, args});
    return (await hear()).result;
}

/** Everything that a page must not do: complain, fail, or try what its policy forbids. */
async function watch(page, faults) {
    page.on("console", (message) => ["error", "warning"].includes(message.type()) && faults.push(message.text()));
    page.on("response", (answer) => answer.status() === 410 && faults.push(`410: ${answer.request().method()} ${answer.url()}`));
    page.on("pageerror", (error) => faults.push(error.stack));
    await page.exposeFunction("reportViolation", (text) => { faults.push(text); });
    await page.addInitScript(() => addEventListener("securitypolicyviolation", (event) => {
        window.reportViolation(`policy: ${event.violatedDirective} ${event.blockedURI}`);
    }));
}

// Chromium drops what it loads when the machine gets or loses a network, as other tests make it do.
const CHANGED = /ERR_NETWORK_CHANGED/;
const LOADS_MAX = 4;
const READY_MS = 20000;

/** Lets page.goto return when the page works, loading it anew when the network changed meanwhile. */
function steady(page, faults) {
    const load = page.goto.bind(page);
    page.goto = async (address) => {
        for (let i = 1; ; i++) {
            const before = faults.filter((fault) => CHANGED.test(fault)).length;
            const changed = () => faults.filter((fault) => CHANGED.test(fault)).length > before;
            try {
                await load(address);
                const end = Date.now() + READY_MS;
                while (!await page.locator("#farm-pill[data-state=ready], #token-dialog[open]").count() && !changed() && Date.now() < end)
                    await page.waitForTimeout(50);
            } catch (error) {
                if (!CHANGED.test(error.message))
                    throw error;
                faults.push(error.message);
            }
            if (!changed() || i === LOADS_MAX)
                return;
            await load("about:blank");
        }
    };
}

async function run(browser, {scenario, url, args}) {
    const {default: play, allowed = /^$/} = await import(`./scenarios/${scenario}.mjs`);
    const context = await browser.newContext({viewport: {width: 1440, height: 860}, ...args.context});
    const faults = [];
    try {
        const page = await context.newPage();
        page.setDefaultTimeout(args.timeout);
        await watch(page, faults);
        steady(page, faults);
        const result = await play({page, url, args, call, faults});
        const left = faults.filter((fault) => !allowed.test(fault) && !CHANGED.test(fault));
        return left.length > 0 ? {ok: false, error: left.join("\n")} : {ok: true, result};
    } catch (error) {
        return {ok: false, error: [error.stack, ...faults].join("\n")};
    } finally {
        await context.close();
    }
}

const browser = await chromium.launch({executablePath: process.argv[2], args: ["--no-sandbox", "--disable-gpu"]});
say({ready: true});
for await (const line of lines)
    say(await run(browser, JSON.parse(line)));
await browser.close();
