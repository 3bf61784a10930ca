// The source of `jaxcontact play`: each answer is a run of the solver on this computer.
"use strict";

const STAGES = {
  compiling: "Compiling the solver for this contact: some seconds, once",
  computing: "Computing",
};

const SOURCE = {
  intro: "A constant load presses a steel ball, bead or roller on a soft film. Each move of a slider is a whole run of jaxcontact on this computer.",
  accuracy: "The grid has 48 × 48 cells, or 96 across a roller.",

  async presets() {
    const { presets, span } = await (await fetch("presets.json")).json();
    for (const preset of Object.values(presets)) {
      const ends = Object.entries(preset.values).map(([name, value]) => [name, [value / span, value * span]]);
      preset.limits = Object.fromEntries(ends);
    }
    return presets;
  },

  // What a request waits for, in words.
  async stage() {
    const { stage } = await (await fetch("stage")).json();
    return STAGES[stage];
  },

  // The results for values of a preset; Error with a line that says why there are none.
  async answer(preset, values) {
    let response;
    try {
      response = await fetch("run", { method: "POST", body: JSON.stringify({ preset, values }) });
    } catch {
      throw new Error("The command jaxcontact play has ended; start it again and reload this page");
    }
    if (!response.ok) throw new Error(await response.text());
    const answer = await response.json();
    if (answer.failure) throw new Error(`No result: ${answer.failure}`);
    const strain = Number((100 * answer.strain).toPrecision(2));
    return { ...answer, remark: `The film is compressed by ${strain} % of its thickness at most` };
  },

  // The grid of the run, for a case file.
  grid({ indenter }, { x }) {
    if (indenter !== "roller") return "n = 48\n";
    return `shape = [${x.length}, 1]\nspacing = [${((x.at(-1) - x[0]) / (x.length - 1)).toPrecision(6)}, 1.0]\nperiodic = [false, true] # plane strain\n`;
  },
};
