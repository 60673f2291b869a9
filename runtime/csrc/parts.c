/* Memory that the caller gives, laid out part by part. */

/* Where `memory` is null the parts are only counted, and their pointers are null. */
typedef struct {
    lanes_t *memory;
    long long used;                 /* lanes                                                                 */
} parts_t;

static void *lanes_part(parts_t *parts, long long lanes)
{
    lanes_t *const part = parts->memory ? parts->memory + parts->used : 0;
    parts->used += lanes;
    return part;
}

static void *numbers_part(parts_t *parts, long long numbers)
{
    return lanes_part(parts, (numbers + LANES - 1)/LANES);
}
