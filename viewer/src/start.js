// The only code that stands in the page as it is: unpacks the rest and starts it.

import { inflated } from "./unpacking.js";

const content = (id) => document.getElementById(id).textContent;

async function start() {
  const [code, data] = await Promise.all([inflated(content("code")), inflated(content("data"))]);
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(code);
  document.head.append(script); // it defines omniroll.show
  globalThis.omniroll.show(data);
}

start().catch((problem) => {
  const message = document.createElement("p");
  message.className = "failure";
  message.textContent = `This page needs a browser of 2023 or newer. It said: ${problem.message}`;
  document.querySelector("main").replaceChildren(message);
});
