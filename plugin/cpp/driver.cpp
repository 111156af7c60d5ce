// Registration and creation of a marked dataset.

#include "shim.h"

#include <exception>

static bool HasPrefix(const char *name)
{
    return STARTS_WITH_CI(name, MESHMARK_PREFIX);
}

static void ReportException(const char *reason)
{
    CPLError(CE_Failure, CPLE_AppDefined, "MESHMARK failed inside: %s", reason);
}

// GDALIdentifyDriver gives no flags, or those of every kind of data (GDAL 3.12); opening gives
// others.
static bool IsAskedForTheDriver(const GDALOpenInfo *info)
{
    return info->nOpenFlags == 0 || info->nOpenFlags == (GDAL_OF_KIND_MASK & ~GDAL_OF_MULTIDIM_RASTER);
}

// GDAL's writers delete a file of the output's name before they make their own, by the driver that
// identifies it. While a map is being read through MESHMARK, that driver is this one, and Delete
// below refuses. So does Open for an update, which GDAL 3.12 calls only for drivers that may
// recognise the file.
static int Identify(GDALOpenInfo *info)
{
    if (HasPrefix(info->pszFilename))
        return TRUE;
    const bool updates = info->eAccess == GA_Update;
    if ((!updates && !IsAskedForTheDriver(info)) || !meshmark_is_being_read(info->pszFilename))
        return FALSE;
    return updates ? GDAL_IDENTIFY_UNKNOWN : TRUE;
}

static GDALDataset *Open(GDALOpenInfo *info)
{
    const char *name = info->pszFilename;
    if (!HasPrefix(name))
    {
        if (info->eAccess == GA_Update && meshmark_is_being_read(name))
            meshmark_refuse_to_write(name, false);
        return nullptr;
    }
    if (info->eAccess == GA_Update)
    {
        meshmark_writer_refuse_update(name + strlen(MESHMARK_PREFIX));
        return nullptr;
    }
    try
    {
        GDALDatasetH source = nullptr;
        const char *source_name = name + strlen(MESHMARK_PREFIX);
        MeshmarkMarking *marking = meshmark_open(source_name, info->papszOpenOptions, &source);
        return marking ? new MeshmarkDataset(GDALDataset::FromHandle(source), marking) : nullptr;
    }
    catch (const std::exception &e)
    {
        ReportException(e.what());
        return nullptr;
    }
}

static GDALDataset *Create(const char *name, int, int, int bands, GDALDataType, MeshmarkTexts options)
{
    if (!HasPrefix(name))
    {
        meshmark_writer_refuse_bare(name);
        return nullptr;
    }
    if (bands > 0)
    {
        CPLError(CE_Failure, CPLE_NotSupported, "%s: a marked map has no raster bands", name);
        return nullptr;
    }
    try
    {
        GDALDatasetH schema = nullptr;
        MeshmarkWriter *writer = meshmark_writer_new(name + strlen(MESHMARK_PREFIX), options, &schema);
        return writer ? new MeshmarkOutputDataset(GDALDataset::FromHandle(schema), writer) : nullptr;
    }
    catch (const std::exception &e)
    {
        ReportException(e.what());
        return nullptr;
    }
}

// GDAL deletes the file of a dataset's name before it creates the dataset, and continues when that
// fails. Create decides what is in the way of a marked map, so this function reports nothing.
static CPLErr Delete(const char *name)
{
    if (!HasPrefix(name))
        meshmark_refuse_to_write(name, true); // some writers go on and truncate the file
    return CE_Failure;
}

static GDALDriver *NewDriver()
{
    auto driver = std::make_unique<GDALDriver>();
    driver->SetDescription(MESHMARK_DRIVER);
    driver->SetMetadataItem(GDAL_DMD_LONGNAME, "Watermarked vector map");
    driver->SetMetadataItem(GDAL_DMD_HELPTOPIC, "docs/driver.md");
    driver->SetMetadataItem(GDAL_DMD_CONNECTION_PREFIX, MESHMARK_PREFIX);
    driver->SetMetadataItem(GDAL_DMD_OPENOPTIONLIST, meshmark_option_list());
    driver->SetMetadataItem(GDAL_DMD_CREATIONOPTIONLIST, meshmark_creation_option_list());
    // The driver of the format reports what it lacks of these: see MeshmarkOutputDataset.
    driver->SetMetadataItem(GDAL_DMD_CREATIONFIELDDATATYPES,
                            "Integer Integer64 Real String Date DateTime Time Binary IntegerList Integer64List "
                            "RealList StringList");
    driver->SetMetadataItem(GDAL_DMD_CREATIONFIELDDATASUBTYPES, "Boolean Int16 Float32 JSON UUID");
    for (const char *capability :
         {GDAL_DCAP_CREATE, GDAL_DCAP_CREATE_LAYER, GDAL_DCAP_CREATE_FIELD, GDAL_DCAP_VECTOR, GDAL_DCAP_VIRTUALIO, GDAL_DCAP_FIELD_DOMAINS, GDAL_DCAP_RELATIONSHIPS,
          GDAL_DCAP_Z_GEOMETRIES, GDAL_DCAP_MEASURED_GEOMETRIES, GDAL_DCAP_CURVE_GEOMETRIES,
          GDAL_DCAP_FEATURE_STYLES, GDAL_DCAP_MULTIPLE_VECTOR_LAYERS})
        driver->SetMetadataItem(capability, "YES");
    driver->pfnIdentify = Identify;
    driver->pfnOpen = Open;
    driver->pfnCreate = Create;
    driver->pfnDelete = Delete;
    return driver.release();
}

// Called while GDAL loads its plugins: nothing here may end in GDALAllRegister.
void meshmark_shim_register()
{
    if (!GDAL_CHECK_VERSION(MESHMARK_DRIVER) || GDALGetDriverByName(MESHMARK_DRIVER))
        return;
    try
    {
        GetGDALDriverManager()->RegisterDriver(NewDriver());
    }
    catch (const std::exception &e)
    {
        ReportException(e.what());
    }
}

GDALDatasetH meshmark_shim_view(GDALDatasetH source, MeshmarkMarking *marking)
{
    try
    {
        return GDALDataset::ToHandle(new MeshmarkDataset(GDALDataset::FromHandle(source), marking));
    }
    catch (const std::exception &e)
    {
        ReportException(e.what());
        return nullptr;
    }
}

char *meshmark_shim_list_as_json(OGRFeatureH feature, int field)
{
    return OGRFeature::FromHandle(feature)->GetFieldAsSerializedJSon(field);
}

GDALDatasetH meshmark_shim_filter(GDALDatasetH source, CSLConstList options)
{
    try
    {
        meshmark_shim_register(); // callers ask a dataset for its driver
        MeshmarkMarking *marking = meshmark_mark(source, options);
        if (!marking)
            return nullptr;
        GDALReferenceDataset(source);
        auto dataset = new MeshmarkDataset(GDALDataset::FromHandle(source), marking);
        dataset->SetDescription((std::string(MESHMARK_PREFIX) + GDALGetDescription(source)).c_str());
        return GDALDataset::ToHandle(dataset);
    }
    catch (const std::exception &e)
    {
        ReportException(e.what());
        return nullptr;
    }
}
