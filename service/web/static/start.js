// The server has put the state into the page: it is painted first, and the scripts come after.

requestAnimationFrame(() => setTimeout(() => import("/static/page.js"), 0));
