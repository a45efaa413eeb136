// Starts Swagger UI on the service's own description. No validator: it would send the description's address elsewhere.
// No links to single routes: they would be links inside of buttons, which a screen reader does not tell.
"use strict";

SwaggerUIBundle({ url: "/openapi.json", dom_id: "#swagger-ui", validatorUrl: null });
