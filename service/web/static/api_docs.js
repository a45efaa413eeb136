// Starts Swagger UI on the service's own description, light or dark as the browser asks for. No validator: it would send
// the description's address elsewhere.
// No links to single routes: they would be links inside of buttons, which a screen reader does not tell.
"use strict";

const dark = matchMedia("(prefers-color-scheme: dark)");
const follow = () => document.documentElement.classList.toggle("dark-mode", dark.matches);
follow();
dark.addEventListener("change", follow);

SwaggerUIBundle({ url: "/openapi.json", dom_id: "#swagger-ui", validatorUrl: null });
