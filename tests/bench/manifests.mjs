// SPDX-License-Identifier: Apache-2.0
// node manifests.mjs MODULES < [{"place": …, "value": …}, …]
// Validates Kubernetes objects by the schemas of kubernetes-models and @kubernetes-models/keda, and prints
// a line for each: "PLACE: KIND NAME: ok" or what is wrong.
import { readFileSync } from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";

async function modelOf(apiVersion, kind) {
  const home = apiVersion.startsWith("keda.sh/") ? "@kubernetes-models/keda" : "kubernetes-models";
  const file = path.join(process.argv[2], home, apiVersion, "index.js");
  const models = await import(pathToFileURL(file));
  return models[kind] ?? models.default[kind];
}

let failed = 0;
for (const { place, value } of JSON.parse(readFileSync(0, "utf-8"))) {
  let verdict = "ok";
  try {
    const Model = await modelOf(value.apiVersion, value.kind);
    new Model(value).validate();
  } catch (error) {
    verdict = error.message;
    failed++;
  }
  console.log(`${place}: ${value.kind} ${value.metadata?.name}: ${verdict}`);
}
process.exit(failed ? 1 : 0);
