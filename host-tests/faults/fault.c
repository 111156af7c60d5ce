/* Preloaded into a host to make it fail: at the n-th call that changes files the process is killed
   (FAULT=kill), or from then on the disk is full (FAULT=full). FAULT_AT is n; calls are counted from 1.
   Programs that the host starts are spared. At the end the number of calls is written to the file FAULT_LOG, if there is one. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long calls;

/* Returns whether this call fails for lack of space. */
static int disk_is_full(void)
{
    const char *fault = getenv("FAULT"), *at = getenv("FAULT_AT");
    long call = atomic_fetch_add(&calls, 1) + 1;
    if (!fault || !at || call < atol(at))
        return 0;
    if (strcmp(fault, "kill") == 0)
        kill(getpid(), SIGKILL);
    if (strcmp(fault, "full") != 0)
        return 0;
    errno = ENOSPC;
    return 1;
}

__attribute__((constructor)) static void spare_children(void)
{
    unsetenv("LD_PRELOAD");
}

__attribute__((destructor)) static void report(void)
{
    const char *log = getenv("FAULT_LOG");
    FILE *file = log ? fopen(log, "w") : NULL;
    if (file)
    {
        fprintf(file, "%ld\n", (long)calls);
        fclose(file);
    }
}

#define REAL(name, type) ((type)dlsym(RTLD_NEXT, name))

/* Printed output goes to no file. */
static int is_terminal(const void *stream)
{
    return stream == stdout || stream == stderr;
}

#define FAILS_WITH(failure, result, name, parameters, types, arguments)                                    \
    FAILS_UNLESS(0, failure, result, name, parameters, types, arguments)
#define FAILS_UNLESS(exempt, failure, result, name, parameters, types, arguments)                          \
    result name parameters                                                                                  \
    {                                                                                                       \
        return !(exempt) && disk_is_full() ? (failure) : REAL(#name, result(*) types) arguments;                         \
    }

FAILS_UNLESS(fd == 1 || fd == 2, -1, ssize_t, write, (int fd, const void *data, size_t size), (int, const void *, size_t), (fd, data, size))
FAILS_WITH(-1, ssize_t, pwrite, (int fd, const void *data, size_t size, off_t at),
           (int, const void *, size_t, off_t), (fd, data, size, at))
FAILS_WITH(-1, ssize_t, pwrite64, (int fd, const void *data, size_t size, off64_t at),
           (int, const void *, size_t, off64_t), (fd, data, size, at))
FAILS_UNLESS(is_terminal(file), 0, size_t, fwrite, (const void *data, size_t size, size_t count, FILE *file),
           (const void *, size_t, size_t, FILE *), (data, size, count, file))
FAILS_WITH(-1, int, fsync, (int fd), (int), (fd))
FAILS_WITH(-1, int, fdatasync, (int fd), (int), (fd))
FAILS_WITH(-1, int, link, (const char *from, const char *to), (const char *, const char *), (from, to))
FAILS_WITH(-1, int, linkat, (int a, const char *from, int b, const char *to, int flags),
           (int, const char *, int, const char *, int), (a, from, b, to, flags))
FAILS_WITH(-1, int, rename, (const char *from, const char *to), (const char *, const char *), (from, to))
FAILS_WITH(-1, int, mkdir, (const char *path, mode_t mode), (const char *, mode_t), (path, mode))

/* A full disk does not prevent the removal of files. */
#define COUNTED(result, name, parameters, types, arguments)                                                 \
    result name parameters                                                                                  \
    {                                                                                                       \
        disk_is_full();                                                                                     \
        return REAL(#name, result(*) types) arguments;                                                      \
    }

COUNTED(int, unlink, (const char *path), (const char *), (path))
COUNTED(int, unlinkat, (int fd, const char *path, int flags), (int, const char *, int), (fd, path, flags))
COUNTED(int, rmdir, (const char *path), (const char *), (path))
COUNTED(int, fclose, (FILE *file), (FILE *), (file))
