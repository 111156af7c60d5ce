// A layer whose features are the source's, one at a time, with marked geometry.

#include "shim.h"

#include <cmath>
#include <limits>

// The interval between checks of the source's files, so that a change is detected before a writer
// commits.
constexpr int FEATURES_BETWEEN_CHECKS = 256;
// The metadata domain in which GDAL keeps members of a GeoJSON file.
constexpr const char *NATIVE_DATA = "NATIVE_DATA";

MeshmarkLayer::MeshmarkLayer(MeshmarkDataset &dataset, OGRLayer &source, int number, const MeshmarkMarking *marking)
    : m_dataset(dataset), m_source(source), m_number(number), m_marking(marking),
      m_marked(source.GetLayerDefn()->GetGeomFieldCount() > 0 && meshmark_marks_layer(marking, source.GetName())),
      m_nativeData(meshmark_native_data(source.GetMetadata(NATIVE_DATA)))
{
    SetDescription(source.GetName());
}

GDALDataset *MeshmarkLayer::GetDataset()
{
    return &m_dataset;
}

// --- metadata: the source's, but for the unmarked extent that a GeoJSON file has in its words ----

static bool IsNativeData(const char *domain)
{
    return domain && EQUAL(domain, NATIVE_DATA);
}

MeshmarkTexts MeshmarkLayer::GetMetadata(const char *domain)
{
    return IsNativeData(domain) ? m_nativeData.List() : m_source.GetMetadata(domain);
}

const char *MeshmarkLayer::GetMetadataItem(const char *name, const char *domain)
{
    return IsNativeData(domain) ? m_nativeData.FetchNameValue(name) : m_source.GetMetadataItem(name, domain);
}

// --- reading -------------------------------------------------------------------------------------

void MeshmarkLayer::ResetReading()
{
    if (m_dataset.ReadsInTurn())
        m_dataset.EndTurnOf(*this);
    else
        m_source.ResetReading();
    m_ended = false;
    m_fromStart = true;
    m_came = 0;
    m_untilCheck = 0;
}

OGRFeature *MeshmarkLayer::GetNextFeature()
{
    while (auto feature = ReadNext())
    {
        if (!PassesFilters(*feature))
            continue;
        DropIgnoredGeometry(*feature);
        m_nFeaturesRead++;
        return feature.release();
    }
    return nullptr;
}

// Returns the next feature of the source, marked. After a failure there is none until the next
// reset.
OGRFeatureUniquePtr MeshmarkLayer::ReadNext()
{
    if (m_ended)
        return nullptr;
    const auto errors = CPLGetErrorCounter();
    OGRFeatureUniquePtr feature;
    if (m_dataset.GiveTurn(*this, m_came == 0))
        feature.reset(m_source.GetNextFeature());
    const bool failed = CPLGetErrorCounter() != errors && CPLGetLastErrorType() == CE_Failure;
    bool good = true;
    if (!feature || m_untilCheck-- == 0)
    {
        good = meshmark_source_is_unchanged(m_marking);
        m_untilCheck = FEATURES_BETWEEN_CHECKS;
    }
    if (feature && good && Mark(*feature))
    {
        m_came++;
        return feature;
    }
    m_ended = true;
    m_dataset.EndTurnOf(*this);
    if (!feature && good && !failed)
        CheckEnd();
    return nullptr;
}

// Checks that as many features are read as were marked.
void MeshmarkLayer::CheckEnd() const
{
    const bool is_filtered = !m_readsAll && (m_poFilterGeom || m_pszAttrQueryString);
    if (m_fromStart && !is_filtered)
        meshmark_is_complete(m_marking, m_source.GetName(), m_number, m_came);
}

OGRFeature *MeshmarkLayer::GetFeature(GIntBig fid)
{
    if (m_dataset.ReadsInTurn())
        return OGRLayer::GetFeature(fid);
    OGRFeatureUniquePtr feature(m_source.GetFeature(fid));
    if (!feature || !meshmark_source_is_unchanged(m_marking) || !Mark(*feature))
        return nullptr;
    DropIgnoredGeometry(*feature);
    return feature.release();
}

OGRErr MeshmarkLayer::SetNextByIndex(GIntBig index)
{
    if (!SourceFilters() || m_dataset.ReadsInTurn())
        return OGRLayer::SetNextByIndex(index);
    m_ended = m_fromStart = false;
    return m_source.SetNextByIndex(index);
}

bool MeshmarkLayer::Mark(OGRFeature &feature)
{
    if (feature.GetNativeData())
        meshmark_clear_native_data(OGRFeature::ToHandle(&feature));
    for (int field = 0; m_marked && field < feature.GetGeomFieldCount(); field++)
    {
        if (!MarkGeometry(feature, field))
            return false;
    }
    return true;
}

bool MeshmarkLayer::MarkGeometry(OGRFeature &feature, int field)
{
    OGRGeometry *geometry = feature.GetGeomFieldRef(field);
    if (!geometry || geometry->IsEmpty())
        return true;
    m_wkb.resize(geometry->WkbSize());
    OGRErr error = geometry->exportToWkb(wkbNDR, m_wkb.data(), wkbVariantIso);
    if (error == OGRERR_NONE)
    {
        const int64_t moved = meshmark_move(m_marking, GetName(), feature.GetFID(), m_wkb.data(), m_wkb.size());
        if (moved <= 0)
            return moved == 0;
        OGRGeometry *marked = nullptr;
        error = OGRGeometryFactory::createFromWkb(m_wkb.data(), nullptr, &marked, m_wkb.size(), wkbVariantIso);
        if (error == OGRERR_NONE)
        {
            marked->assignSpatialReference(geometry->getSpatialReference());
            feature.SetGeomFieldDirectly(field, marked);
            return true;
        }
    }
    CPLError(CE_Failure, CPLE_AppDefined, "layer \"%s\", feature " CPL_FRMT_GIB ": its %s cannot be marked", GetName(),
             feature.GetFID(), geometry->getGeometryName());
    return false;
}

// --- filters: spatial ones see marked geometry ---------------------------------------------------

bool MeshmarkLayer::PassesFilters(OGRFeature &feature)
{
    if (SourceFilters())
        return true;
    if (m_poFilterGeom && !FilterGeometry(feature.GetGeomFieldRef(m_iGeomFieldFilter)))
        return false;
    return !m_evaluatesGeometry || m_poAttrQuery->Evaluate(&feature);
}

#if MESHMARK_GDAL_AT_LEAST(11)
OGRErr MeshmarkLayer::ISetSpatialFilter(int field, const OGRGeometry *geometry)
{
    m_iGeomFieldFilter = field;
    InstallFilter(geometry);
    ApplySpatialFilterToSource();
    ResetReading();
    return OGRERR_NONE;
}
#else
void MeshmarkLayer::SetSpatialFilter(OGRGeometry *geometry)
{
    SetSpatialFilter(0, geometry);
}

void MeshmarkLayer::SetSpatialFilter(int field, OGRGeometry *geometry)
{
    if (field < 0 || (field > 0 && field >= GetLayerDefn()->GetGeomFieldCount()))
    {
        CPLError(CE_Failure, CPLE_AppDefined, "Invalid geometry field index : %d", field);
        return;
    }
    m_iGeomFieldFilter = field;
    InstallFilter(geometry);
    ApplySpatialFilterToSource();
    ResetReading();
}
#endif

// Hosts call it without a number: with one, GDAL 3.10 reports an error for tables without geometry.
static void SetFilter(OGRLayer &source, int field, OGRGeometry *geometry)
{
    if (field == 0)
        source.SetSpatialFilter(geometry);
    else
        source.SetSpatialFilter(field, geometry);
}

// A straight edge moves no further than its ends do, so a source's rectangle that is wider by the
// furthest move loses no feature; PassesFilters then decides. Arcs may move further than their
// points.
void MeshmarkLayer::ApplySpatialFilterToSource()
{
    ApplyIgnoredFieldsToSource();
    const int field = m_iGeomFieldFilter;
    if (!m_marked || !m_poFilterGeom)
        SetFilter(m_source, field, m_poFilterGeom);
    else if (!HasStraightEdges(field))
        SetFilter(m_source, field, nullptr);
    else
    {
        double x, y;
        meshmark_reach(m_marking, &x, &y);
        const auto &e = m_sFilterEnvelope;
        const auto rounding = [](double a, double b)
        { return 4 * std::numeric_limits<double>::epsilon() * (std::fabs(a) + std::fabs(b)); };
        x += rounding(e.MinX, e.MaxX);
        y += rounding(e.MinY, e.MaxY);
        m_source.SetSpatialFilterRect(field, e.MinX - x, e.MinY - y, e.MaxX + x, e.MaxY + y);
    }
}

void MeshmarkLayer::ApplyFiltersToSource()
{
    if (m_readsAll)
        return;
    if (m_pszAttrQueryString && !m_evaluatesGeometry)
        m_source.SetAttributeFilter(m_pszAttrQueryString);
    ApplySpatialFilterToSource();
}

bool MeshmarkLayer::HasStraightEdges(int field) const
{
    if (!m_source.TestCapability(OLCCurveGeometries))
        return true;
    switch (wkbFlatten(m_source.GetLayerDefn()->GetGeomFieldDefn(field)->GetType()))
    {
        case wkbPoint:
        case wkbLineString:
        case wkbPolygon:
        case wkbMultiPoint:
        case wkbMultiLineString:
        case wkbMultiPolygon:
        case wkbTriangle:
        case wkbTIN:
        case wkbPolyhedralSurface:
            return true;
        default:
            return false;
    }
}

// The source evaluates the filter, in its own language and with its own indices, unless the filter
// depends on geometry (OGR_GEOM_AREA, OGR_GEOMETRY): such a filter must be OGR SQL, which this
// class can evaluate.
OGRErr MeshmarkLayer::SetAttributeFilter(const char *query)
{
    CPLPushErrorHandler(CPLQuietErrorHandler);
    const bool is_ogr_sql = OGRLayer::SetAttributeFilter(query) == OGRERR_NONE;
    CPLPopErrorHandler();
    CPLErrorReset();
    m_evaluatesGeometry = m_marked && is_ogr_sql && AttributeFilterEvaluationNeedsGeometry();

    const bool refused = m_marked && !is_ogr_sql && NamesGeometry(query);
    if (refused)
        CPLError(CE_Failure, CPLE_NotSupported, "the filter %s depends on geometry: write it in OGR SQL, so that it "
                 "applies to the marked geometry", query);
    const bool hand_on = !m_evaluatesGeometry && !refused;
    const OGRErr error = m_source.SetAttributeFilter(hand_on ? query : nullptr);
    if (refused || error != OGRERR_NONE)
        OGRLayer::SetAttributeFilter(nullptr);
    ApplyIgnoredFieldsToSource();
    ResetReading();
    return refused ? OGRERR_FAILURE : error;
}

bool MeshmarkLayer::NamesGeometry(const char *query) const
{
    OGRFeatureDefn *defn = m_source.GetLayerDefn();
    for (int i = 0; i < defn->GetGeomFieldCount(); i++)
    {
        const char *name = defn->GetGeomFieldDefn(i)->GetNameRef();
        if (*name && CPLString(query).ifind(name) != std::string::npos)
            return true;
    }
    return false;
}

// --- ignored fields ------------------------------------------------------------------------------

OGRErr MeshmarkLayer::SetIgnoredFields(MeshmarkFieldNames names)
{
    m_ignored = CPLStringList(CSLDuplicate(const_cast<char **>(names)));
    return ApplyIgnoredFieldsToSource();
}

// A filter needs its geometry even where the reader does not.
OGRErr MeshmarkLayer::ApplyIgnoredFieldsToSource()
{
    m_ignoredButRead.clear();
    CPLStringList ignored;
    const OGRFeatureDefn *defn = m_source.GetLayerDefn();
    for (int i = 0; i < m_ignored.size(); i++)
    {
        const int field = EQUAL(m_ignored[i], "OGR_GEOMETRY") ? 0 : defn->GetGeomFieldIndex(m_ignored[i]);
        const bool filtered = (m_poFilterGeom && field == m_iGeomFieldFilter) || (m_evaluatesGeometry && field == 0);
        if (m_marked && filtered)
            m_ignoredButRead.push_back(field);
        else
            ignored.AddString(m_ignored[i]);
    }
    return m_source.SetIgnoredFields(
        const_cast<MeshmarkFieldNames>(const_cast<const char **>(ignored.List())));
}

void MeshmarkLayer::DropIgnoredGeometry(OGRFeature &feature) const
{
    for (int field : m_ignoredButRead)
        feature.SetGeomFieldDirectly(field, nullptr);
}

// --- counts and extents --------------------------------------------------------------------------

GIntBig MeshmarkLayer::GetFeatureCount(int force)
{
    return SourceFilters() ? m_source.GetFeatureCount(force) : OGRLayer::GetFeatureCount(force);
}

#if MESHMARK_GDAL_AT_LEAST(11)
OGRErr MeshmarkLayer::IGetExtent(int field, OGREnvelope *extent, bool force)
{
    return Extent(field, extent, force);
}
#else
OGRErr MeshmarkLayer::GetExtent(OGREnvelope *extent, int force)
{
    return Extent(0, extent, force != FALSE);
}

OGRErr MeshmarkLayer::GetExtent(int field, OGREnvelope *extent, int force)
{
    return Extent(field, extent, force != FALSE);
}
#endif

// Returns the extent of all features, whatever the filters, as most drivers do.
OGRErr MeshmarkLayer::Extent(int field, OGREnvelope *extent, bool force)
{
    if (!m_marked)
        return m_source.GetExtent(field, extent, force);
    *extent = OGREnvelope();
    if (field < 0 || field >= GetLayerDefn()->GetGeomFieldCount())
    {
        CPLError(CE_Failure, CPLE_AppDefined, "Invalid geometry field index : %d", field);
        return OGRERR_FAILURE;
    }
    if (m_extents.empty() && (!force || !MeasureExtents()))
        return OGRERR_FAILURE;
    *extent = m_extents[field];
    return extent->IsInit() ? OGRERR_NONE : OGRERR_FAILURE;
}

// Reads the whole layer, as the source has only the unmarked vertices.
bool MeshmarkLayer::MeasureExtents()
{
    const int fields = GetLayerDefn()->GetGeomFieldCount();
    std::vector<OGREnvelope> extents(fields);
    m_source.SetIgnoredFields(nullptr);
    m_source.SetAttributeFilter(nullptr);
    SetFilter(m_source, m_iGeomFieldFilter, nullptr);
    m_readsAll = true;
    ResetReading();
    CPLErrorReset();
    while (auto feature = ReadNext())
    {
        for (int field = 0; field < fields; field++)
        {
            const OGRGeometry *geometry = feature->GetGeomFieldRef(field);
            if (!geometry || geometry->IsEmpty())
                continue;
            OGREnvelope envelope;
            geometry->getEnvelope(&envelope);
            extents[field].Merge(envelope);
        }
    }
    const bool complete = CPLGetLastErrorType() != CE_Failure;
    m_readsAll = false;
    ApplyFiltersToSource();
    ResetReading();
    if (complete)
        m_extents = std::move(extents);
    return complete;
}

// --- capabilities --------------------------------------------------------------------------------

int MeshmarkLayer::TestCapability(const char *capability) MESHMARK_CONST
{
    const auto is = [capability](const char *other) { return EQUAL(capability, other); };
    if (is(OLCFastGetExtent))
        return m_marked ? !m_extents.empty() : m_source.TestCapability(capability);
    if (is(OLCFastSpatialFilter))
        return (!m_marked || HasStraightEdges(m_iGeomFieldFilter)) && m_source.TestCapability(capability);
    if (is(OLCFastFeatureCount) || is(OLCFastSetNextByIndex))
        return SourceFilters() && m_source.TestCapability(capability);
    for (const char *handed_on : {OLCRandomRead, OLCStringsAsUTF8, OLCIgnoreFields, OLCCurveGeometries,
                                  OLCMeasuredGeometries, OLCZGeometries})
    {
        if (is(handed_on))
            return m_source.TestCapability(capability);
    }
    return FALSE;
}
