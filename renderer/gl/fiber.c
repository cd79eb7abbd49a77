#include "renderer/gl/fiber.h"
#include "protocol/memory.h"
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <ucontext.h>
#include <unistd.h>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/common_interface_defs.h>
#endif
#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

/* As much as a main thread has: drivers compile shaders on it. Pages are only taken when touched. */
#define STACK_BYTES ((size_t)8 << 20)

struct gl_fiber {
    ucontext_t own, caller;
    char *stack; /* the lowest page is a guard */
    void (*run)(void *);
    void *context;
    bool ended;
    /* What the sanitizers want to know about changes of stacks. */
    void *own_fake, *caller_fake, *own_tsan, *caller_tsan;
    const void *caller_stack;
    size_t caller_bytes;
};

struct gl_fiber *gl_fiber_create(void)
{
    struct gl_fiber *fiber = pen_alloc_zero(1, sizeof *fiber);
    fiber->ended = true;
    fiber->stack = mmap(NULL, STACK_BYTES, PROT_READ | PROT_WRITE,
        MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
    if (fiber->stack == MAP_FAILED)
        abort();
    mprotect(fiber->stack, (size_t)sysconf(_SC_PAGESIZE), PROT_NONE);
    return fiber;
}

void gl_fiber_destroy(struct gl_fiber *fiber)
{
    if (!fiber)
        return;
    munmap(fiber->stack, STACK_BYTES);
    free(fiber);
}

/* Before and after the processor changes stacks; `ends`: this one is not come back to. */
static void leave_for_caller(struct gl_fiber *fiber, bool ends)
{
    (void)fiber, (void)ends;
#ifdef __SANITIZE_ADDRESS__
    __sanitizer_start_switch_fiber(
        ends ? NULL : &fiber->own_fake, fiber->caller_stack, fiber->caller_bytes);
#endif
#ifdef __SANITIZE_THREAD__
    __tsan_switch_to_fiber(fiber->caller_tsan, 0);
#endif
}

static void arrive(struct gl_fiber *fiber)
{
    (void)fiber;
#ifdef __SANITIZE_ADDRESS__
    __sanitizer_finish_switch_fiber(fiber->own_fake, &fiber->caller_stack, &fiber->caller_bytes);
#endif
}

/* makecontext hands over integers only. */
static void enter(unsigned high, unsigned low)
{
    struct gl_fiber *fiber = (struct gl_fiber *)((uintptr_t)high << 32 | low);
    arrive(fiber);
    fiber->run(fiber->context);
    fiber->ended = true;
    leave_for_caller(fiber, true);
}

void gl_fiber_begin(struct gl_fiber *fiber, void (*run)(void *context), void *context)
{
    getcontext(&fiber->own);
    fiber->own.uc_stack.ss_sp = fiber->stack;
    fiber->own.uc_stack.ss_size = STACK_BYTES;
    fiber->own.uc_link = &fiber->caller;
    fiber->run = run;
    fiber->context = context;
    fiber->ended = false;
    fiber->own_fake = NULL;
    uintptr_t address = (uintptr_t)fiber;
    makecontext(
        &fiber->own, (void (*)(void))enter, 2, (unsigned)(address >> 32), (unsigned)address);
#ifdef __SANITIZE_THREAD__
    fiber->own_tsan = __tsan_create_fiber(0);
#endif
}

bool gl_fiber_resume(struct gl_fiber *fiber)
{
#ifdef __SANITIZE_ADDRESS__
    __sanitizer_start_switch_fiber(&fiber->caller_fake, fiber->stack, STACK_BYTES);
#endif
#ifdef __SANITIZE_THREAD__
    fiber->caller_tsan = __tsan_get_current_fiber();
    __tsan_switch_to_fiber(fiber->own_tsan, 0);
#endif
    swapcontext(&fiber->caller, &fiber->own);
#ifdef __SANITIZE_ADDRESS__
    __sanitizer_finish_switch_fiber(fiber->caller_fake, NULL, NULL);
#endif
#ifdef __SANITIZE_THREAD__
    if (fiber->ended)
        __tsan_destroy_fiber(fiber->own_tsan);
#endif
    return fiber->ended;
}

void gl_fiber_pause(struct gl_fiber *fiber)
{
    leave_for_caller(fiber, false);
    swapcontext(&fiber->own, &fiber->caller);
    arrive(fiber);
}
