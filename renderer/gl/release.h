/* A rasteriser in software keeps what a drawing has used until its record of that drawing is taken for
 * another one, and it has 64: what gl_deleted_bytes counts may be there still, hundreds of megabytes. */
#pragma once

/* Makes the device take all of its records for others. Leaves the state as it is. */
void gl_release(void);
/* Before the context goes; fine without a gl_release. */
void gl_release_finish(void);
