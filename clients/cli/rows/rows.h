/* What each command takes: a row an option. Its parser, --help, the page of the manual and the
 * shells' completion are made of them. */
#pragma once
#include "clients/cli/cli.h"

/* What a shell offers for a value or a word. */
enum cli_offer {
    CLI_OFFER_NOTHING,
    CLI_OFFER_FILES,
    CLI_OFFER_FOLDERS,
    CLI_OFFER_SCENES, /* files, and scenes of the server */
    CLI_OFFER_JOBS,
    CLI_OFFER_TECHNIQUES,
};

struct cli_row {
    const char *name;  /* of one letter: -o */
    const char *value; /* what it is called; NULL: the option is a flag */
    const char *help;  /* a sentence or two */
    enum cli_offer offer;
    const char *const *choices; /* all values there are, ended by NULL; or NULL */
    size_t offset;              /* of a const char * or, for a flag, a bool in the options, or */
    bool (*take)(struct cli_args *args, void *options, const char *value); /* false: reported */
};

/* What every command's options begin with. */
struct cli_common {
    struct cli_server server;
    bool help;            /* printed: there is nothing more to do */
    const char *words[4]; /* in order; NULL behind the last */
    uint32_t count;
};

/* What of the request's rows a command takes besides its own. */
enum cli_requests { CLI_NO_REQUEST, CLI_RENDER_REQUEST, CLI_SEQUENCE_REQUEST };

struct cli_action { /* a first word that says what is done */
    const char *name;
    const char *words; /* what follows it, as in "SCENE NAME" */
    const char *help;
    enum cli_offer offer; /* for the second word */
};

struct cli_command {
    const char *name, *summary;
    const char *words;                /* as in "SCENE" */
    const char *about;                /* paragraphs; NULL: the summary is enough */
    const struct cli_action *actions; /* ended by a NULL name; or NULL */
    const struct cli_row *rows;       /* ended by a NULL name */
    enum cli_offer offer;             /* for the first word, without actions */
    const char *const *choices;       /* all that the first word can be; or NULL */
    enum cli_requests requests;
    bool local; /* talks to no server */
    uint32_t most_words;
    int (*run)(const struct cli_command *command, struct cli_args *args);
};

/* An option as it is shown. */
struct cli_shown {
    const char *name, *usage, *help; /* usage: "--width N" */
    bool flag, negatable;            /* negatable: --no-NAME, too */
    bool takes_equals;               /* a flag that may have =VALUE */
    const char *const *choices;
    const char *word; /* may be given besides; or NULL */
    enum cli_offer offer;
};
typedef void cli_show(void *context, const struct cli_shown *row);
