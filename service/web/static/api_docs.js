// Starts Swagger UI on the service's own description. No validator: it would send the description's address elsewhere.
"use strict";

SwaggerUIBundle({ url: "/openapi.json", dom_id: "#swagger-ui", deepLinking: true, validatorUrl: null });
