/* What every example shares: a call that must succeed, a law that must hold. */
#ifndef TOILE_EXAMPLE_CHECK_H
#define TOILE_EXAMPLE_CHECK_H

#include <stdio.h>
#include <stdlib.h>

#include "toile.h"

#define CALL(call)                                                                        \
    do {                                                                                  \
        toile_status status_ = (call);                                                    \
        if (status_ != TOILE_OK) {                                                        \
            fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__,                        \
                    toile_status_name(status_), toile_last_error());                      \
            exit(2);                                                                      \
        }                                                                                 \
    } while (0)

#define HOLDS(law)                                                                        \
    do {                                                                                  \
        if (!(law)) {                                                                     \
            fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #law);      \
            exit(1);                                                                      \
        }                                                                                 \
    } while (0)

#endif
