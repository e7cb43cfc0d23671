/* Where cyclictest is missing: sleeps on a fixed grid and prints how late each wake-up was, in nanoseconds, one a line.
 * Usage: reference PERIOD_NS TICKS. Scheduling is inherited. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

int main(int argc, char **argv)
{
    if (argc != 3)
        return 2;
    long period = atol(argv[1]), ticks = atol(argv[2]);
    long *late = calloc(ticks, sizeof *late);
    if (!late)
        return 1;
    mlockall(MCL_CURRENT | MCL_FUTURE);
    struct timespec due, now;
    clock_gettime(CLOCK_MONOTONIC, &due);
    for (long i = 0; i < ticks; i++) {
        due.tv_nsec += period;
        for (; due.tv_nsec >= 1000000000L; due.tv_nsec -= 1000000000L)
            due.tv_sec++;
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
        clock_gettime(CLOCK_MONOTONIC, &now);
        late[i] = (now.tv_sec - due.tv_sec) * 1000000000L + now.tv_nsec - due.tv_nsec;
    }
    for (long i = 0; i < ticks; i++)
        printf("%ld\n", late[i]);
    return 0;
}
