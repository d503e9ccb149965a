// One trial that plays as soon as the page is there; replay_view.js does all of it.
(async () => {
  "use strict";
  const text = (id) => document.getElementById(id).textContent;
  const player = taReplay.player();
  const columns = await taReplay.inflated(taReplay.decoded(text("frames")));
  player.show(taReplay.motion(JSON.parse(text("scene")), columns), 0);
  document.documentElement.dataset.ready = "1";
})();
