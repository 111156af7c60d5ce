// A marked dataset: the source's layers, each behind a layer of ours.

#include "shim.h"

MeshmarkDataset::MeshmarkDataset(GDALDataset *source, MeshmarkMarking *marking)
    : m_source(source), m_marking(marking)
{
    poDriver = GetGDALDriverManager()->GetDriverByName(MESHMARK_DRIVER);
    for (int i = 0; i < source->GetLayerCount(); i++)
        m_layers.push_back(std::make_unique<MeshmarkLayer>(*this, *source->GetLayer(i), marking));
}

MeshmarkDataset::~MeshmarkDataset()
{
    MeshmarkDataset::CloseDependentDatasets();
}

int MeshmarkDataset::CloseDependentDatasets()
{
    m_layers.clear();
    GDALDataset *source = m_source;
    m_source = nullptr;
    if (source)
        source->ReleaseRef();
    return source != nullptr;
}

MESHMARK_CONST OGRLayer *MeshmarkDataset::GetLayer(int index) MESHMARK_CONST
{
    return index >= 0 && index < GetLayerCount() ? m_layers[index].get() : nullptr;
}

int MeshmarkDataset::TestCapability(const char *capability) MESHMARK_CONST
{
    for (const char *handed_on : {ODsCCurveGeometries, ODsCMeasuredGeometries, ODsCZGeometries})
    {
        if (EQUAL(capability, handed_on))
            return m_source && m_source->TestCapability(capability);
    }
    return FALSE;
}

std::vector<std::string> MeshmarkDataset::GetFieldDomainNames(CSLConstList options) const
{
    return m_source ? m_source->GetFieldDomainNames(options) : std::vector<std::string>();
}

const OGRFieldDomain *MeshmarkDataset::GetFieldDomain(const std::string &name) const
{
    return m_source ? m_source->GetFieldDomain(name) : nullptr;
}

std::vector<std::string> MeshmarkDataset::GetRelationshipNames(CSLConstList options) const
{
    return m_source ? m_source->GetRelationshipNames(options) : std::vector<std::string>();
}

const GDALRelationship *MeshmarkDataset::GetRelationship(const std::string &name) const
{
    return m_source ? m_source->GetRelationship(name) : nullptr;
}

OGRStyleTable *MeshmarkDataset::GetStyleTable()
{
    return m_source ? m_source->GetStyleTable() : nullptr;
}

char **MeshmarkDataset::GetFileList()
{
    return m_source ? m_source->GetFileList() : nullptr;
}

MeshmarkTexts MeshmarkDataset::GetMetadata(const char *domain)
{
    return m_source ? m_source->GetMetadata(domain) : nullptr;
}

char **MeshmarkDataset::GetMetadataDomainList()
{
    return m_source ? m_source->GetMetadataDomainList() : nullptr;
}

const char *MeshmarkDataset::GetMetadataItem(const char *name, const char *domain)
{
    return m_source ? m_source->GetMetadataItem(name, domain) : nullptr;
}
