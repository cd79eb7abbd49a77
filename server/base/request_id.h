/* What a request is called in answers and logs: 32 hexadecimal digits, at random. */
#pragma once
#define REQUEST_ID_BYTES 33

void request_id_make(char text[REQUEST_ID_BYTES]);
